"""Who we are to a server, and whom we believe: keys, certificates, logins."""
