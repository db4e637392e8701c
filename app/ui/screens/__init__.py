"""The screens: one package each, a view that shows what its presenter resolved."""
