"""
Stands in for the registered package where there is none: the names of its interface, which MJEnv adds methods to.
"""
module CommonRLInterface

abstract type AbstractEnv end

for name in (:reset!, :actions, :observe, :act!, :terminated, :clone, :state, :setstate!, :observations, :render)
    @eval function $name end
end

end
