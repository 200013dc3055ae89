"""Tables, charts and the page of comparisons of modes, of studies and of sensitivities."""
