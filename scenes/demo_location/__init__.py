"""The demo location: a gallery café that opens to a sunlit court, modelled and lit in Python."""
