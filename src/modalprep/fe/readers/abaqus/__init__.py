"""Reader of Abaqus and CalculiX input decks."""
