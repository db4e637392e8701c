"""The Light screen: where to hold a second light."""
