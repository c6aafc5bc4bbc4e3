"""The intermediate representation: statements, loops and branches."""
