"""The Probe screen: the panorama of a place and everything that makes one."""
