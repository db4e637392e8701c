"""Small components: each has an accessible name, a focus ring, its states, and the keyboard."""
