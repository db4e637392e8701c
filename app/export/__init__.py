"""Pictures and pages to hand on."""
