// MuJoCo in C: torques of an arm at rest; readings by its distance of a disk and a ball.

#include <mujoco/mujoco.h>
#include <string.h>

// Torques of `count` configurations of 6.
void w5(const mjModel *model, mjData *data, const double *q, long count, double *tau) {
    for (long n = 0; n < count; ++n, q += 6, tau += 6) {
        memcpy(data->qpos, q, 6 * sizeof(double));
        mj_kinematics(model, data);
        mj_comPos(model, data);
        mj_rne(model, data, 0, tau);
    }
}

// Readings of `count` ball centres, m. Geoms 0 to 2 are the disks, 3 is the ball: each disk advances along its axis by its
// distance from the ball, until that is below `near`. Its face is at -`rest` when it reads zero, and `half` before its centre.
void w6(const mjModel *model, mjData *data, const double *centre, long count, double rest, double half, double near,
        double *reading) {
    for (long n = 0; n < count; ++n, centre += 3, reading += 3) {
        memcpy(data->geom_xpos + 9, centre, 3 * sizeof(double));
        for (int k = 0; k < 3; ++k) {
            double *place = data->geom_xpos + 3 * k;
            place[k] = centre[k] - rest - half;
            for (double gap = 1.0; gap > near;) {
                gap = mj_geomDistance(model, data, k, 3, 1.0, 0);
                place[k] += gap;
            }
            reading[k] = place[k] + half + rest;
        }
    }
}
