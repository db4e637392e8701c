"""What is kept: places and settings."""
