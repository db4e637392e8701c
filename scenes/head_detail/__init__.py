"""The details that turn the bald heads into faces: colours, pores, brows, lashes, hair, a collar.

Everything here is made by rules from the CC0 heads themselves; no photo is used.
"""
