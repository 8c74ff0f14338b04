// A program that is a library: the loader takes the library's variant for the processor (glibc-hwcaps).
int palpate_main(int count, char** words);

int main(int count, char** words) {
  return palpate_main(count, words);
}
