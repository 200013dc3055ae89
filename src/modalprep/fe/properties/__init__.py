"""What a mesh group is made of: materials, sections, properties."""
