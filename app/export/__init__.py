"""Images and PDF pages for sharing."""
