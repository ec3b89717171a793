import { readdirSync } from "node:fs";
import { defineConfig } from "vite";

const tests = readdirSync(new URL("test", import.meta.url)).filter((name) =>
  /\.test\.ts$/.test(name),
);

/** Makes JavaScript of the unit tests, which Node's own test runner runs. */
export default defineConfig({
  publicDir: false,
  build: {
    ssr: true,
    outDir: "../../target/dashboard-test",
    emptyOutDir: true,
    minify: false,
    rolldownOptions: {
      input: Object.fromEntries(tests.map((name) => [name.replace(/\.ts$/, ""), `test/${name}`])),
      output: { entryFileNames: "[name].mjs" },
    },
  },
});
