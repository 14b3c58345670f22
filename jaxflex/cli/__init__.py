"""The commands of the command line; nothing else imports from here."""
