"""The logic of the screens, independent of Qt.

Presenters turn models into states that the views show.
"""
