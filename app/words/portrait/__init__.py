"""Text about heads, the light on a face and the age of the light."""
