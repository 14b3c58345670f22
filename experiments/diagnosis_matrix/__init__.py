"""How often is the diagnosis right? Effects hidden in data of another making."""
