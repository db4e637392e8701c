"""The cameras: the models of Ricoh Theta, and the exposures that each accepts."""
