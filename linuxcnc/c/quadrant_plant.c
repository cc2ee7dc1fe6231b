/* The realtime component `quadrant_plant`: the simulated stage, volts in, counts out. */
#include "rtapi.h"
#include "rtapi_app.h"
#include "rtapi_string.h"
#include "hal.h"
#include "quadrant_linuxcnc.h"

MODULE_AUTHOR("The Quadrant authors");
MODULE_DESCRIPTION("Three simulated axes with friction");
MODULE_LICENSE("GPL");

static char *file = "";
RTAPI_MP_STRING(file, "description of the stage (TOML)");
static char *record = "";
RTAPI_MP_STRING(record, "file for the record of command and true position");
static int rate = 1000;
RTAPI_MP_INT(rate, "rate of the thread, Hz");
static int drive_lag_us = 0;
RTAPI_MP_INT(drive_lag_us, "lag of amplifiers in velocity mode, us; 0: torque mode");
static int seed = 1;
RTAPI_MP_INT(seed, "seed of the noise");
static int room = 400000;
RTAPI_MP_INT(room, "longest record, ticks");

typedef struct {
    hal_float_t *voltage, *position_cmd, *position_fb, *index_step;
    hal_bit_t *freeze, *index_enable;
    hal_s32_t *rawcounts;
} axis_t;

typedef struct {
    hal_bit_t *enable, *record;
    axis_t axis[3];
} hal_plant_t;

static const char axes[] = "xyz";
static int comp_id;
static hal_plant_t *hal;
static struct Plant *plant;
static struct QuadrantPlantPins pins;

static void read_encoders(void *arg, long period)
{
    int n;

    for (n = 0; n < 3; n++) {
        pins.axes[n].freeze = *hal->axis[n].freeze;
        pins.axes[n].index_enable = *hal->axis[n].index_enable;
    }
    quadrant_plant_read(plant, &pins);
    for (n = 0; n < 3; n++) {
        *hal->axis[n].rawcounts = pins.axes[n].rawcounts;
        *hal->axis[n].position_fb = pins.axes[n].position_fb;
        *hal->axis[n].index_enable = pins.axes[n].index_enable;
    }
}

static void write_voltages(void *arg, long period)
{
    int n;

    pins.enable = *hal->enable;
    pins.record = *hal->record;
    for (n = 0; n < 3; n++) {
        pins.axes[n].voltage = *hal->axis[n].voltage;
        pins.axes[n].position_cmd = *hal->axis[n].position_cmd;
    }
    quadrant_plant_write(plant, &pins);
    for (n = 0; n < 3; n++) *hal->axis[n].index_step = pins.axes[n].index_step;
}

/* The parameters as before loadrt: the module stays in memory when it is unloaded, and the next loadrt sets what it names. */
static void forget(void)
{
    file = record = "";
    rate = 1000;
    drive_lag_us = 0;
    seed = 1;
    room = 400000;
}

static int start(void)
{
    struct QuadrantPlantConfig config = {
        .file = file, .record = record, .rate = rate, .drive_lag_us = drive_lag_us, .seed = seed, .room = room,
    };
    int n, r;

    memset(&pins, 0, sizeof(pins));
    comp_id = hal_init("quadrant_plant");
    if (comp_id < 0) return comp_id;
    plant = quadrant_plant_start(&config);
    hal = hal_malloc(sizeof(*hal));
    r = !plant || !hal;
    if (!r) {
        r |= hal_pin_bit_newf(HAL_IN, &hal->enable, comp_id, "quadrant_plant.enable");
        r |= hal_pin_bit_newf(HAL_IN, &hal->record, comp_id, "quadrant_plant.record");
        for (n = 0; n < 3; n++) {
            axis_t *a = &hal->axis[n];
            r |= hal_pin_float_newf(HAL_IN, &a->voltage, comp_id, "quadrant_plant.%c.voltage", axes[n]);
            r |= hal_pin_float_newf(HAL_IN, &a->position_cmd, comp_id, "quadrant_plant.%c.position-cmd", axes[n]);
            r |= hal_pin_bit_newf(HAL_IN, &a->freeze, comp_id, "quadrant_plant.%c.freeze", axes[n]);
            r |= hal_pin_bit_newf(HAL_IO, &a->index_enable, comp_id, "quadrant_plant.%c.index-enable", axes[n]);
            r |= hal_pin_float_newf(HAL_OUT, &a->index_step, comp_id, "quadrant_plant.%c.index-step", axes[n]);
            r |= hal_pin_float_newf(HAL_OUT, &a->position_fb, comp_id, "quadrant_plant.%c.position-fb", axes[n]);
            r |= hal_pin_s32_newf(HAL_OUT, &a->rawcounts, comp_id, "quadrant_plant.%c.rawcounts", axes[n]);
        }
        r |= hal_export_funct("quadrant_plant.read", read_encoders, NULL, 1, 0, comp_id);
        r |= hal_export_funct("quadrant_plant.write", write_voltages, NULL, 1, 0, comp_id);
    }
    if (r != 0) {
        hal_exit(comp_id);
        quadrant_plant_stop(plant);
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
    hal_exit(comp_id);
    quadrant_plant_stop(plant);
    forget();
}
