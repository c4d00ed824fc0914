# Draws of resets for the model; noise, delays and pushes.

"""
    randomize!(env, document)

Replaces the parts of the JSON document of draws, noise, delays and pushes that this one has, from each row's next reset
on; null removes a part. docs/randomisation.md describes the document. Later, `write!(env, "draws[0]", [low, high]; rows)`
changes the parameters of the first draw for some rows, and `read` reads them. Returns `env`.
"""
randomize!(env::Env, document::AbstractString) = call(mjenv_randomize, env, text(document))

"The document with all parts that are set, as JSON."
randomization(env::Env) =
    inside(handle -> borrowed(answer(mjenv_randomization, handle, Cstring(C_NULL))), env)
