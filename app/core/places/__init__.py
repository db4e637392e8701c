"""Store each place and time in a folder, with its light, its results and the user's files.

`open_files` opens files, `load_saved` loads a saved place, `solve_place` computes its answers,
`save` writes it, and `resume` completes an interrupted capture. `place_folder` manages the folder
of one place, and `place_list` lists all places.
"""
