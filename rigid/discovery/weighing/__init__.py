"""How probable every explanation of what a fit leaves over is."""
