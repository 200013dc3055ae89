"""What people look at: tables, charts, pictures, the HTML page."""
