"""The logic of the screens, without Qt. Presenters turn models into states for the views."""
