"""Pictures of every screen: `turnlight --demo --screenshots DIR`."""
