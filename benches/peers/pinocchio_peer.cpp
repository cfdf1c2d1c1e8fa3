// Pinocchio in C++: poses and gravity torques are the library's, the 31 columns are assembled from its link frames.

#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using RowMajor3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

namespace {

// Numbers of a joint: turn (9, row-major) and place (3) in the link before; mass, centre of mass (3), inertia (9, row-major).
constexpr int JOINT = 25;
// Numbers of a result: TCP (3), 31 columns of 3, torques (6).
constexpr int RESULT = 102;

struct Arm {
    pinocchio::Model model;
    pinocchio::Data data;
    Vector3d base, tool;
};

pinocchio::Model model_of(const double *joints) {
    pinocchio::Model model;
    for (int i = 0; i < 6; ++i, joints += JOINT) {
        const pinocchio::SE3 placement(Map<const RowMajor3d>(joints), Map<const Vector3d>(joints + 9));
        const pinocchio::Inertia inertia(joints[12], Map<const Vector3d>(joints + 13), Map<const RowMajor3d>(joints + 16));
        const auto joint = model.addJoint(i, pinocchio::JointModelRZ(), placement, "j" + std::to_string(i + 1));
        model.appendBodyToJoint(joint, inertia);
    }
    model.gravity.linear() << 0.0, 0.0, -9.80665;
    return model;
}

} // namespace

extern "C" {

Arm *arm(const double *joints, const double *base, const double *tool) {
    const auto model = model_of(joints);
    return new Arm{model, pinocchio::Data(model), Map<const Vector3d>(base), Map<const Vector3d>(tool)};
}

// TCP, columns and torques of `count` configurations of 6.
void w1(Arm *arm, const double *q, long count, double *result) {
    auto &[model, data, base, tool] = *arm;
    for (long n = 0; n < count; ++n, q += 6, result += RESULT) {
        const Map<const Vector6d> joints(q);
        pinocchio::forwardKinematics(model, data, joints);
        const Vector6d tau = pinocchio::computeGeneralizedGravity(model, data, joints);
        const Vector3d tcp = data.oMi[6].act(tool);
        Map<Vector3d>{result} = tcp;
        Map<Eigen::Matrix<double, 3, 31>> column(result + 3);
        const auto origin = [&](int i) { return data.oMi[i].translation(); };
        const auto axis = [&](int i, int k) { return data.oMi[i].rotation().col(k); };
        column.leftCols<3>().setIdentity();
        for (int k = 0; k < 3; ++k) {
            column.col(3 + k) = Vector3d::Unit(2 - k).cross(tcp - base);
        }
        for (int i = 1; i <= 5; ++i) {
            column.col(5 + i) = axis(i, 0).cross(tcp - origin(i));
            column.col(10 + i) = axis(i, 0);
            column.col(19 + i) = axis(i + 1, 2).cross(tcp - origin(i + 1));
            column.col(25 + i) = tau[i] * column.col(19 + i);
        }
        for (int i = 3; i <= 6; ++i) {
            column.col(13 + i) = axis(i, 2);
        }
        column.col(25) = axis(2, 1).cross(tcp - origin(3));
        Map<Vector6d>{result + 96} = tau;
    }
}

// Torques of `count` configurations of 6.
void w5(Arm *arm, const double *q, long count, double *tau) {
    for (long n = 0; n < count; ++n, q += 6, tau += 6) {
        Map<Vector6d>{tau} = pinocchio::computeGeneralizedGravity(arm->model, arm->data, Map<const Vector6d>(q));
    }
}
}
