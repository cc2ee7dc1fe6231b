# Moves x in inches, then gives a drive that follows by itself a torque offset: `result` says how it ended.
trap 'echo "$what" >result' EXIT
set -e
# Least and most of a pin in one and a half periods of the sine.
range() { for n in $(seq 60); do halcmd getp "$1"; sleep 0.05; done | sort -g | sed -n '1p;$p' | tr '\n' ' '; }
# True if the two numbers $1 and $2 are between the bounds $3 to $4 and $5 to $6.
within() { awk "BEGIN { exit !($1 >= $3 && $1 <= $4 && $2 >= $5 && $2 <= $6) }"; }
what="not driven in inches"
halcmd setp quadrant.x.enable 1
sleep 0.5
test "$(halcmd getp quadrant.driven)" = TRUE
halcmd setp siggen.0.reset 0
sleep 3
what="0.4 inch are not 10.16 mm: $(range quadrant_plant.x.position-fb)"
within $(range quadrant_plant.x.position-fb) -0.05 0.2 10 10.2
what="the error in inches is large: $(range quadrant.x.error)"
within $(range quadrant.x.error) -0.001 0 0 0.001
what="not loaded for feedforward alone"
halcmd setp quadrant.x.enable 0
sleep 1
halcmd setp siggen.0.reset 1
halcmd setp siggen.0.amplitude 5
halcmd setp siggen.0.offset 5
halcmd unloadrt quadrant
halcmd loadrt quadrant defaults=settings.toml port=0 feedback=position mode=feedforward
halcmd addf quadrant.update servo
halcmd addf to-per-mille servo
halcmd addf torque-offset servo
halcmd net cmd quadrant.x.position-cmd quadrant.x.position-fb
halcmd net vel quadrant.x.velocity-cmd
halcmd net friction quadrant.x.output to-per-mille.in
halcmd net per-mille to-per-mille.out torque-offset.in
sleep 0.5
halcmd setp quadrant.x.enable 1
sleep 0.5
what="not driven for feedforward alone: fault $(halcmd getp quadrant.x.fault)"
test "$(halcmd getp quadrant.driven)" = TRUE
halcmd setp siggen.0.reset 0
sleep 3
what="the torque offset is no friction of some 12 per mille: $(range torque-offset.out), fault $(halcmd getp quadrant.x.fault)"
within $(range torque-offset.out) -20 -10 10 20
what=done
