"""What is kept beside places: settings, libraries, JSON files, locks on folders."""
