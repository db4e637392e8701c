"""The Turn screen: the way to the light, live pictures, and photographs taken."""
