"""What the screens show and do, without Qt: models in, states for the views out."""
