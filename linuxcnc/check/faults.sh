# Stops an encoder, unloads the component while it drives, and loads it again: `result` says how it ended.
trap 'echo "$what" >result' EXIT
set -e
is() { for try in 1 2 3 4 5 6 7 8 9 10; do test "$(halcmd getp "$1")" = "$2" && return; sleep 0.2; done; return 1; }
# Enables x where it stands.
enable() {
    halcmd setp quadrant.x.enable 0
    sleep 1
    halcmd setp siggen.0.amplitude 0
    halcmd setp siggen.0.offset "$(halcmd getp quadrant_plant.x.position-fb)"
    sleep 0.1
    halcmd setp quadrant.x.enable 1
    is quadrant.driven TRUE
}
what="not driven at first"
halcmd setp quadrant.x.enable 1
is quadrant.driven TRUE
what="an encoder that stops is not found, or a voltage stays"
sleep 0.5
halcmd setp quadrant_plant.x.freeze 1
is quadrant.x.faulted TRUE
is quadrant.driven FALSE
test "$(halcmd getp quadrant_plant.x.voltage)" = 0
what="not driven after a fault"
halcmd setp quadrant_plant.x.freeze 0
enable
what="not unloaded while it drives, or a voltage stays"
halcmd unloadrt quadrant
test "$(halcmd getp quadrant_plant.x.voltage)" = 0
what="not loaded again"
halcmd loadrt quadrant defaults=settings.toml settings=settings.store port=0
halcmd addf quadrant.update servo 3
halcmd net fb quadrant.x.position-fb
halcmd net cmd quadrant.x.position-cmd
halcmd net counts quadrant.x.rawcounts
halcmd net volts quadrant.x.output
halcmd net driven quadrant.driven
enable
what=done
