/* What the components of LinuxCNC call. Made from linuxcnc/src; do not edit. */

#ifndef QUADRANT_LINUXCNC_H
#define QUADRANT_LINUXCNC_H

#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

// The outputs could not be enabled: no axis is commissioned, the settings are damaged, or an axis moves.
#define NOT_ENABLED 100

// A joint no longer follows LinuxCNC: a host has stopped it, or its settings want it homed by the law.
#define ENDED 101

// The thread's period is not the one that the settings are for.
#define OTHER_PERIOD 102

// The command is no number, or faster than 100 m/s.
#define NO_NUMBER 103

// A host drove the axes when LinuxCNC's machine was switched on.
#define HOST_DRIVES 104

// Position and count do not grow together as the settings' resolution says.
#define OTHER_SCALE 105

// Most ticks by which a command can be delayed.
#define MOST_DELAY_TICKS 31

// The fast half of a component.
typedef struct Board Board;

// The simulated stage.
typedef struct Plant Plant;

// Parameters of the component `quadrant`, as `loadrt` has them; text may be null.
typedef struct QuadrantConfig {
  // File that keeps stored settings.
  const char *settings;
  // Settings (TOML) while nothing is stored.
  const char *defaults;
  // The joints: `x,y,z` or some of them.
  const char *joints;
  // Machine units: `mm` or `inch`.
  const char *units;
  // Source of the counts: `rawcounts` or `position`.
  const char *feedback;
  // `full`, or `feedforward` for the feedforward alone.
  const char *mode;
  // `extrapolate` or `delay`.
  const char *preview;
  // Address of the link, such as `127.0.0.1`.
  const char *address;
  // Port of the link; 0 for none.
  int port;
  // Control rate while there are no settings, Hz.
  int rate;
  // Periods from one tick to the next above which the outputs go off; 0 for no limit.
  int late;
} QuadrantConfig;

// The pins of a joint.
typedef struct QuadrantJoint {
  // In: commanded position, machine units.
  double position_cmd;
  // In: its velocity, machine units per second.
  double velocity_cmd;
  // In: measured position, machine units.
  double position_fb;
  // In: the encoder's count, which no index resets.
  int32_t rawcounts;
  // In: LinuxCNC leads the joint.
  bool enable;
  // In: the amplifier reports a fault.
  bool amp_fault;
  // In and out: P, I, D, FF1 and FF2, V, machine units and s: those in force, or others that are to act.
  double gains[5];
  // Out: voltage for the amplifier, V.
  double output;
  // Out: friction that is fed forward, V: the level of Coulomb and Stribeck.
  double ff_level;
  // Out: viscous friction, V.
  double ff_viscous;
  // Out: friction before sliding, V.
  double ff_presliding;
  // Out: inertia, V.
  double ff_inertia;
  // Out: commanded less measured position, machine units.
  double error;
  // Out: scale of the friction that was learnt; 1 is the commissioned one.
  double learning;
  // Out: the joint is at fault, or another is.
  bool faulted;
  // Out: number of the fault; 0 for none.
  int32_t fault;
} QuadrantJoint;

// Everything that passes between the pins and the law in a tick.
typedef struct QuadrantPins {
  // In: the time at which the tick began, ns.
  int64_t now_ns;
  // In: the thread's period, ns.
  int64_t period_ns;
  // In: duration of the last tick, ns.
  int64_t elapsed_ns;
  // In: the emergency stop is pressed.
  bool estop;
  // Out: the outputs are driven.
  bool driven;
  // Out: what a host has stored could not be written to its file.
  bool store_failed;
  // The joints: x, y, z.
  struct QuadrantJoint joints[3];
} QuadrantPins;

// Parameters of the component `quadrant_plant`; text may be null.
typedef struct QuadrantPlantConfig {
  // Description of a stage (TOML); the simulated stage without one.
  const char *file;
  // File for the record.
  const char *record;
  // Rate of the thread, Hz.
  int rate;
  // Lag of amplifiers in velocity mode, us; 0 for torque mode.
  int drive_lag_us;
  // Seed of the noise.
  int seed;
  // Longest record, ticks.
  int room;
} QuadrantPlantConfig;

// The pins of a simulated axis.
typedef struct QuadrantPlantAxis {
  // In: voltage of the amplifier, V.
  double voltage;
  // In: commanded position for the record, mm.
  double position_cmd;
  // In: the encoder shows its last count.
  bool freeze;
  // In and out: the next index pulse makes its place zero, and ends this.
  bool index_enable;
  // Out: the encoder's count.
  int32_t rawcounts;
  // Out: the same since the index, mm.
  double position_fb;
  // Out: largest change of the voltage from one period to the next, just after the index, V.
  double index_step;
} QuadrantPlantAxis;

// The pins of the simulated stage.
typedef struct QuadrantPlantPins {
  // In: the amplifiers are enabled.
  bool enable;
  // In: this tick is recorded.
  bool record;
  // The axes: x, y, z.
  struct QuadrantPlantAxis axes[3];
} QuadrantPlantPins;

// Starts the component; null, and a line on standard error, if it cannot.
//
// # Safety
// Every text ends with a zero.
struct Board *quadrant_start(const struct QuadrantConfig *config);

// One period of the realtime thread.
//
// # Safety
// `board` is what `quadrant_start` has given, and no other thread uses it.
void quadrant_tick(struct Board *board, struct QuadrantPins *pins);

// Ends the component, and the threads of its slow half.
//
// # Safety
// `board` is what `quadrant_start` has given, or null, and is not used again.
void quadrant_stop(struct Board *board);

// Starts the simulated stage; null, and a line on standard error, if it cannot.
//
// # Safety
// Every text ends with a zero.
struct Plant *quadrant_plant_start(const struct QuadrantPlantConfig *config);

// Begins a period: reads the encoders.
//
// # Safety
// `plant` is what `quadrant_plant_start` has given, and no other thread uses it.
void quadrant_plant_read(struct Plant *plant, struct QuadrantPlantPins *pins);

// Ends a period: moves the axes.
//
// # Safety
// As [`quadrant_plant_read`].
void quadrant_plant_write(struct Plant *plant, struct QuadrantPlantPins *pins);

// Ends the simulated stage, and writes the record.
//
// # Safety
// `plant` is what `quadrant_plant_start` has given, or null, and is not used again.
void quadrant_plant_stop(struct Plant *plant);

#endif  /* QUADRANT_LINUXCNC_H */
