// The login page works without this. A link followed from another site's page arrives without the
// session that it just began, as the cookie is for this site's own pages only: ask once more from here.

if (!document.body.dataset.ways.includes("inside")) {
  const reply = await fetch("/api/login");
  if (reply.ok && (await reply.json()).who !== null) location.replace("/");
}
