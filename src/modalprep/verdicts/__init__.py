"""What a result is worth: notes and warnings for the user, requirements, and the verdict that follows."""
