"""The Turn screen: the way to the light, the live picture and the photos taken there."""
