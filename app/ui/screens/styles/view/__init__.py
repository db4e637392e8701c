"""What the screen looks like: Qt, and no decisions."""
