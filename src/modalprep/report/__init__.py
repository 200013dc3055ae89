"""Reports: tables, charts, pictures and the HTML page."""
