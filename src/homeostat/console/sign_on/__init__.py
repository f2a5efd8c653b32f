"""Single sign-on: people whom a provider of the site knows (OpenID Connect, authorization code with PKCE)."""
