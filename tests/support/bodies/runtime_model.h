// Small bodies for the runtime's tests, baked in memory by dense algebra: a second route beside
// palpate-precompute.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "formats/model.h"

namespace palpate::test {

/// K [dN x dN] of all nodes, dense, without boundary conditions [N/m].
Eigen::MatrixXd assemble_stiffness(const Model& model);

/// The lower triangle of a symmetric matrix; with split precision beside a made-up smooth part.
PackedGreens pack(const Eigen::MatrixXd& matrix, Precision precision);

/// A symmetric positive definite matrix with a dominant diagonal, the same for the same seed.
Eigen::MatrixXd random_definite(Eigen::Index order, unsigned seed);

/// A body of one material, E = 1 Pa, nu = 0.3, in the plane in plane stress, clamped where `clamped` says so,
/// without loads; stored nodes in a scrambled order, or as the mesh has them.
Model bake(Mesh mesh, const std::function<bool(const Vec3&)>& clamped, Scope scope, Precision precision,
           bool scrambled = true);

/// The unit cube of cells^3 cells (tet4, tet10 or hex8) or the unit square of cells^2 (quad4 or tri3).
Mesh unit_mesh(ElementType element, int cells);

/// That, clamped at the bottom (z = 0, in the plane y = 0).
Model unit_model(ElementType element, int cells, Scope scope, Precision precision);

/// A cube whose elements with their middle below z = 1/2 count as a second material. Forces are those of one.
Model two_materials(ElementType element, int cells);

/// That of tet4 or, with two dimensions, of quad4.
Model unit_model(int dimension, int cells, Scope scope, Precision precision);

/// A cylinder along z of radius 1 and height 1, held at both ends; in the plane half a ring of radii 1/2 and
/// 1 over the x axis, clamped along the inner one. The round side has edges of about 0.2.
Model round_model(int dimension);

/// (x, y, z) in space, (x, z) in the plane: z is the height over the clamped side.
Vec3 upright(int dimension, double x, double y, double z);
/// The middle of the side opposite to the clamped one.
Vec3 top_middle(int dimension);

/// Gives the model a rest displacement as a load would: smooth, zero at the clamped side, `size` [m] large.
void set_rest(Model& model, double size);

}  // namespace palpate::test
