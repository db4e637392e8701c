"""Places: one folder per place and time, with its light, its results and the user's files.

`open` opens files, `load` a saved place, `solve` answers it, `save` writes it, and `resume`
completes an interrupted capture. `store` keeps a folder, `library` all of them.
"""
