"""What external loads do: forces and moments along the backbone, and their second derivatives."""
