"""What every room needs: angles, colour, files, pictures, errors and progress."""
