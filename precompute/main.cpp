// palpate-precompute: from model.toml to NAME.palpate.hdf, once per model.
#include "base/program.h"
#include "precompute/commands.h"
#include "precompute/machine/blas_room.h"
#include "precompute/machine/blas_start.h"

int main(int argc, char** argv) {
  palpate::start_blas(argv);
  palpate::end_with_an_error_on_shrunk_files();
  return palpate::run_program("palpate-precompute", "try --dry-run, and fewer --jobs or a coarser mesh", [&] {
    palpate::check_stack_size();
    return palpate::run_commands(argc, argv);
  });
}
