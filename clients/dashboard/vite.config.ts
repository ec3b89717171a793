import { defineConfig, type ProxyOptions } from "vite";

/** The service that `npm run dev` shows. */
const service = process.env["COGMAP_URL"] ?? "http://127.0.0.1:8080";

/** The service takes changes from its own pages only, and this one comes from elsewhere. */
const proxy: ProxyOptions = { target: service, headers: { origin: service } };

export default defineConfig({
  build: {
    outDir: "../../target/dashboard",
    emptyOutDir: true,
    target: "es2022",
    // The page is served under `default-src 'self'`: nothing may be written into it as data.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1000,
  },
  server: { proxy: { "/v1": proxy, "/metrics": proxy, "/readyz": proxy } },
});
