"""The Light screen, which finds the best place to hold a second light."""
