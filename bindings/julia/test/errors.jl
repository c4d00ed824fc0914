# Tests what a call throws.

using MJEnv: MJENV_E_NAME, MJENV_E_TYPE, MJENV_E_VALUE, MJENV_E_SIZE, MJENV_E_NOT_RESET, MJENV_E_EPISODE_ENDED,
    MJENV_E_PENDING, MJENV_E_NOT_PENDING, MJENV_E_BUSY, MJENV_E_FILE, MJENV_E_MODEL, MJENV_E_SNAPSHOT, MJENV_E_MEMORY

function thrown(f)
    try
        f()
    catch exception
        return exception
    end
    return nothing
end

# Whether f throws an MJEnvError with this status and a message that contains the words.
function refuses(f, status::MJEnv.Status, words...)
    e = thrown(f)
    e isa MJEnvError && e.status == status && all(word -> occursin(word, e.message), words) && return true
    println(stderr, "wanted $status $words, got ", repr(e))
    return false
end

# Whether f throws an exception of this type with a text that contains the words.
function refuses(f, type::Type, words...)
    e = thrown(f)
    e isa type && all(word -> occursin(word, sprint(showerror, e)), words) && return true
    println(stderr, "wanted $type $words, got ", repr(e))
    return false
end
