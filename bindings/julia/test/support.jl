# What several test sets use.

# A function of its own is compiled for its arguments, so that the caller's allocations are not counted.
function allocated(f::F, arguments::Vararg{Any,N}) where {F,N}
    f(arguments...)
    return @allocated f(arguments...)
end

# Runs a script in another Julia process with some threads and more environment variables. Returns what it printed, also
# to standard error.
function spoken(script; threads = 1, variables = ())
    julia = `$(Base.julia_cmd()) --startup-file=no --project=$PACKAGE --threads=$threads`
    command = setenv(`$julia -e $("using MJEnv\n" * script)`, merge(ENV, Dict(variables)))
    said = IOBuffer()
    ended = run(pipeline(ignorestatus(command); stdout = said, stderr = said))
    success(ended) || print(said, "\nexit ", ended.exitcode, ", signal ", ended.termsignal)
    return String(take!(said))
end
