"""The frame around every screen: rail, head line and job line."""
