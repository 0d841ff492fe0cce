"""The corpus of fillets: parts, radii, and which edges."""
