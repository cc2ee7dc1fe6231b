/* The realtime component `quadrant`: exports pins, copies them to the law's structure and back. `man 9 quadrant`. */
#include <unistd.h>

#include "rtapi.h"
#include "rtapi_app.h"
#include "rtapi_string.h"
#include "hal.h"
#include "quadrant_linuxcnc.h"

MODULE_AUTHOR("The Quadrant authors");
MODULE_DESCRIPTION("Servo control law with friction feedforward");
MODULE_LICENSE("GPL");

static char *settings = "";
RTAPI_MP_STRING(settings, "file that keeps stored settings");
static char *defaults = "";
RTAPI_MP_STRING(defaults, "settings (TOML) while nothing is stored");
static char *joints = "x,y,z";
RTAPI_MP_STRING(joints, "axes that are joints");
static char *units = "mm";
RTAPI_MP_STRING(units, "machine units: mm or inch");
static char *feedback = "rawcounts";
RTAPI_MP_STRING(feedback, "counts from rawcounts or position");
static char *mode = "full";
RTAPI_MP_STRING(mode, "full or feedforward");
static char *preview = "extrapolate";
RTAPI_MP_STRING(preview, "extrapolate or delay");
static char *address = "127.0.0.1";
RTAPI_MP_STRING(address, "address of the link");
static int port = 7711;
RTAPI_MP_INT(port, "port of the link; 0 for none");
static int rate = 1000;
RTAPI_MP_INT(rate, "control rate while there are no settings, Hz");
static int late = 0;
RTAPI_MP_INT(late, "periods between ticks above which the outputs go off; 0 for no limit");

/* Pins of a joint, in the order of QuadrantJoint. */
typedef struct {
    hal_float_t *position_cmd, *velocity_cmd, *position_fb;
    hal_s32_t *rawcounts;
    hal_bit_t *enable, *amp_fault;
    hal_float_t *gains[5];
    hal_float_t *output, *ff_level, *ff_viscous, *ff_presliding, *ff_inertia, *error, *learning;
    hal_bit_t *faulted;
    hal_s32_t *fault;
} joint_t;

typedef struct {
    hal_bit_t *estop, *driven, *store_failed;
    joint_t joint[3];
} hal_quadrant_t;

static const char axes[] = "xyz";
static const char *const gains[] = {"Pgain", "Igain", "Dgain", "FF1", "FF2"};
static int comp_id;
static hal_quadrant_t *hal;
static struct Board *board;
static struct QuadrantPins pins;
/* The component is being unloaded. */
static volatile int ends;

static int has(int axis) { return strchr(joints, axes[axis]) != NULL; }

static void update(void *arg, long period)
{
    double asked[3][5];
    int n, g;

    if (ends) return;
    pins.now_ns = rtapi_get_time();
    pins.period_ns = period;
    pins.estop = *hal->estop;
    for (n = 0; n < 3; n++) {
        joint_t *from = &hal->joint[n];
        struct QuadrantJoint *to = &pins.joints[n];
        if (!has(n)) continue;
        to->position_cmd = *from->position_cmd;
        to->velocity_cmd = *from->velocity_cmd;
        to->position_fb = *from->position_fb;
        to->rawcounts = *from->rawcounts;
        to->enable = *from->enable;
        to->amp_fault = *from->amp_fault;
        for (g = 0; g < 5; g++) to->gains[g] = asked[n][g] = *from->gains[g];
    }
    quadrant_tick(board, &pins);
    *hal->driven = pins.driven;
    *hal->store_failed = pins.store_failed;
    for (n = 0; n < 3; n++) {
        struct QuadrantJoint *from = &pins.joints[n];
        joint_t *to = &hal->joint[n];
        if (!has(n)) continue;
        for (g = 0; g < 5; g++)
            if (from->gains[g] != asked[n][g]) *to->gains[g] = from->gains[g];
        *to->output = from->output;
        *to->ff_level = from->ff_level;
        *to->ff_viscous = from->ff_viscous;
        *to->ff_presliding = from->ff_presliding;
        *to->ff_inertia = from->ff_inertia;
        *to->error = from->error;
        *to->learning = from->learning;
        *to->faulted = from->faulted;
        *to->fault = from->fault;
    }
    pins.elapsed_ns = rtapi_get_time() - pins.now_ns;
}

static int export_joint(joint_t *j, char axis)
{
    int g, r = 0;
    r |= hal_pin_float_newf(HAL_IN, &j->position_cmd, comp_id, "quadrant.%c.position-cmd", axis);
    r |= hal_pin_float_newf(HAL_IN, &j->velocity_cmd, comp_id, "quadrant.%c.velocity-cmd", axis);
    r |= hal_pin_float_newf(HAL_IN, &j->position_fb, comp_id, "quadrant.%c.position-fb", axis);
    r |= hal_pin_s32_newf(HAL_IN, &j->rawcounts, comp_id, "quadrant.%c.rawcounts", axis);
    r |= hal_pin_bit_newf(HAL_IN, &j->enable, comp_id, "quadrant.%c.enable", axis);
    r |= hal_pin_bit_newf(HAL_IN, &j->amp_fault, comp_id, "quadrant.%c.amp-fault", axis);
    for (g = 0; g < 5; g++)
        r |= hal_pin_float_newf(HAL_IO, &j->gains[g], comp_id, "quadrant.%c.%s", axis, gains[g]);
    r |= hal_pin_float_newf(HAL_OUT, &j->output, comp_id, "quadrant.%c.output", axis);
    r |= hal_pin_float_newf(HAL_OUT, &j->ff_level, comp_id, "quadrant.%c.ff-level", axis);
    r |= hal_pin_float_newf(HAL_OUT, &j->ff_viscous, comp_id, "quadrant.%c.ff-viscous", axis);
    r |= hal_pin_float_newf(HAL_OUT, &j->ff_presliding, comp_id, "quadrant.%c.ff-presliding", axis);
    r |= hal_pin_float_newf(HAL_OUT, &j->ff_inertia, comp_id, "quadrant.%c.ff-inertia", axis);
    r |= hal_pin_float_newf(HAL_OUT, &j->error, comp_id, "quadrant.%c.error", axis);
    r |= hal_pin_float_newf(HAL_OUT, &j->learning, comp_id, "quadrant.%c.learning", axis);
    r |= hal_pin_bit_newf(HAL_OUT, &j->faulted, comp_id, "quadrant.%c.faulted", axis);
    r |= hal_pin_s32_newf(HAL_OUT, &j->fault, comp_id, "quadrant.%c.fault", axis);
    return r;
}

/* The parameters as before loadrt: the module stays in memory when it is unloaded, and the next loadrt sets what it names. */
static void forget(void)
{
    settings = defaults = "";
    joints = "x,y,z";
    units = "mm";
    feedback = "rawcounts";
    mode = "full";
    preview = "extrapolate";
    address = "127.0.0.1";
    port = 7711;
    rate = 1000;
    late = 0;
}

static int start(void)
{
    struct QuadrantConfig config = {
        .settings = settings, .defaults = defaults, .joints = joints, .units = units, .feedback = feedback,
        .mode = mode, .preview = preview, .address = address, .port = port, .rate = rate, .late = late,
    };
    int n, r;

    ends = 0;
    memset(&pins, 0, sizeof(pins));
    comp_id = hal_init("quadrant");
    if (comp_id < 0) return comp_id;
    board = quadrant_start(&config);
    hal = hal_malloc(sizeof(*hal));
    if (!board || !hal) {
        hal_exit(comp_id);
        quadrant_stop(board);
        return -1;
    }
    r = hal_pin_bit_newf(HAL_IN, &hal->estop, comp_id, "quadrant.estop");
    r |= hal_pin_bit_newf(HAL_OUT, &hal->driven, comp_id, "quadrant.driven");
    r |= hal_pin_bit_newf(HAL_OUT, &hal->store_failed, comp_id, "quadrant.store-failed");
    for (n = 0; n < 3; n++)
        if (has(n)) r |= export_joint(&hal->joint[n], axes[n]);
    r |= hal_export_funct("quadrant.update", update, NULL, 1, 0, comp_id);
    if (r != 0) {
        hal_exit(comp_id);
        quadrant_stop(board);
        return -1;
    }
    hal_ready(comp_id);
    return 0;
}

int rtapi_app_main(void)
{
    int r = start();

    if (r != 0) forget();
    return r;
}

void rtapi_app_exit(void)
{
    int n;

    /* A period under way ends, none begins, and the signals keep zero and a fault, by which LinuxCNC stops. */
    ends = 1;
    usleep(20000);
    for (n = 0; n < 3; n++) {
        if (!has(n)) continue;
        *hal->joint[n].output = 0.0;
        *hal->joint[n].faulted = 1;
    }
    *hal->driven = 0;
    hal_exit(comp_id);
    quadrant_stop(board);
    forget();
}
