"""The logic of the screens without Qt: presenters turn models into states for the views."""
