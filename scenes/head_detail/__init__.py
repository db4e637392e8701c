"""The details that make the bald heads faces: colours, pores, brows, lashes, hair, a collar.

Everything here is made by rules from the CC0 heads themselves; no photograph is used.
"""
