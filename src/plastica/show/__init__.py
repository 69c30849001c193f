"""Pictures, films and pages of finished results. Nothing here solves anything."""
