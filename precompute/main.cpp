// palpate-precompute: from model.toml to NAME.palpate.hdf, once a model.
#include "base/program.h"
#include "precompute/commands.h"
#include "precompute/machine/blas_kernels.h"

int main(int argc, char** argv) {
  palpate::use_fitting_kernels(argv);
  palpate::end_with_an_error_on_shrunk_files();
  return palpate::run_program("palpate-precompute", "try --dry-run, and fewer --jobs or a coarser mesh",
                              [&] { return palpate::run_commands(argc, argv); });
}
