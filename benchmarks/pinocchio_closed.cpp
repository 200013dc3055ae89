// Pinocchio's dynamics of a tree with loop closures in its own loop, on the systems of spatial.py: compiled by
// closed_loops.py.
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/constrained-dynamics.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/multibody.hpp>

namespace pin = pinocchio;

#define EXPORTED extern "C" __attribute__((visibility("default")))

struct Body {  // a body and the joint that it is on; all axes are those of space at q = 0
  double kind, parent, place[3], axis[3], second[3], mass, centre[3], inertia[9];
};

struct Contact {  // a point that two joints hold together
  double a, b, in_a[3], in_b[3];
};

struct System {
  pin::Model model;
  pin::Data data;
  std::vector<pin::RigidConstraintModel> contacts;
  std::vector<pin::RigidConstraintData> contact_data;
  pin::ProximalSettings settings;
  Eigen::VectorXd q, v, tau;
};

static Eigen::Vector3d vector(const double* x) { return Eigen::Vector3d(x[0], x[1], x[2]); }

static pin::SE3 placed(const double* x) { return pin::SE3(Eigen::Matrix3d::Identity(), vector(x)); }

static pin::JointModel joint(const Body& body) {
  switch (int(body.kind)) {
    case 0: return pin::JointModelRevoluteUnaligned(vector(body.axis));
    case 1: return pin::JointModelPrismaticUnaligned(vector(body.axis));
    case 2: return pin::JointModelSpherical();
    default: return pin::JointModelUniversal(vector(body.axis), vector(body.second));
  }
}

EXPORTED void* make_closed(int bodies, const Body* body, int contacts, const Contact* contact, double mu, int steps,
                           const double* v) {
  auto* made = new System;
  for (int i = 0; i < bodies; ++i) {
    const Body& own = body[i];
    const auto index = made->model.addJoint(pin::JointIndex(own.parent), joint(own), placed(own.place),
                                            "j" + std::to_string(i));
    const Eigen::Matrix3d inertia = Eigen::Map<const Eigen::Matrix3d>(own.inertia);
    made->model.appendBodyToJoint(index, pin::Inertia(own.mass, vector(own.centre), inertia), pin::SE3::Identity());
  }
  made->data = pin::Data(made->model);
  for (int i = 0; i < contacts; ++i) {
    const Contact& own = contact[i];
    made->contacts.emplace_back(pin::CONTACT_3D, made->model, pin::JointIndex(own.a), placed(own.in_a),
                                pin::JointIndex(own.b), placed(own.in_b), pin::LOCAL);
  }
  for (const auto& each : made->contacts) made->contact_data.emplace_back(each);
  made->settings = pin::ProximalSettings(1e-10, mu, steps);
  made->q = pin::neutral(made->model);
  made->v = Eigen::Map<const Eigen::VectorXd>(v, made->model.nv);
  made->tau = Eigen::VectorXd::Zero(made->model.nv);
  pin::initConstraintDynamics(made->model, made->data, made->contacts, made->contact_data);
  return made;
}

EXPORTED void repeat_closed(void* given, int count) {
  auto* made = static_cast<System*>(given);
  for (int i = 0; i < count; ++i)
    pin::constraintDynamics(made->model, made->data, made->q, made->v, made->tau, made->contacts, made->contact_data,
                            made->settings);
}

EXPORTED void repeat_tree(void* given, int count) {
  auto* made = static_cast<System*>(given);
  for (int i = 0; i < count; ++i)
    pin::aba(made->model, made->data, made->q, made->v, made->tau, pin::Convention::WORLD);
}

EXPORTED void accelerations(void* given, double* out) {
  auto* made = static_cast<System*>(given);
  Eigen::Map<Eigen::VectorXd>(out, made->model.nv) = made->data.ddq;
}
