"""Places: one folder per place and time, with its light, its results and the user's files.

`open` opens files, `load` a saved place, `solve` computes its answers, `save` writes it, and
`resume` completes an interrupted capture. `store` manages a folder, `library` all of them.
"""
