"""The Open Spherical Camera protocol, as Ricoh's Web API 2.1 speaks it."""
