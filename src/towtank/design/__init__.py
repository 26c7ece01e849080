"""Design studies: which change of a craft makes it stable, what it costs, and how far the craft gets on its energy."""
