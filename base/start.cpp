// Entry point of a program that is a library, so that the loader takes its variant for the processor
// (glibc-hwcaps).
int palpate_main(int count, char** words);

int main(int count, char** words) {
  return palpate_main(count, words);
}
