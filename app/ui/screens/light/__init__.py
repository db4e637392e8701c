"""The Light screen: the best place to hold a second light."""
