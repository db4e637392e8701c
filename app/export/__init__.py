"""Images and PDF pages that users can share."""
