"""The feedback laws side by side on one flexible link, continuous and as a real drive runs them."""
