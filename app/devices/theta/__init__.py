"""The Open Spherical Camera protocol, as defined by Ricoh's Web API 2.1."""
