"""The Turn screen: guidance to the light, the live picture and the photos taken there."""
