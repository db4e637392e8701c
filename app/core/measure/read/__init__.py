"""Read pictures: what their files state, and their pixels."""
