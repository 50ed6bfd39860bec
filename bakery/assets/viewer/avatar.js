var D=Math.PI/180;function j([s,t,e]){let o=Math.hypot(s,t,e);if(o<1e-12)return[1,0,0,0,1,0,0,0,1];[s,t,e]=[s/o,t/o,e/o];let r=Math.cos(o),n=Math.sin(o),i=1-r;return[r+s*s*i,s*t*i-e*n,s*e*i+t*n,t*s*i+e*n,r+t*t*i,t*e*i-s*n,e*s*i-t*n,e*t*i+s*n,r+e*e*i]}function W(s,t,e=0){let[o,r]=[Math.cos(s*D),Math.sin(s*D)],[n,i]=[Math.cos(t*D),Math.sin(t*D)],[c,a]=[Math.cos(-e*D),Math.sin(-e*D)],l=V([o,0,r,0,1,0,-r,0,o],[1,0,0,0,n,-i,0,i,n]);return V(l,[c,-a,0,a,c,0,0,0,1])}function V(s,t){let e=new Array(9);for(let o=0;o<3;o++)for(let r=0;r<3;r++)e[3*o+r]=s[3*o]*t[r]+s[3*o+1]*t[3+r]+s[3*o+2]*t[6+r];return e}var I=(s,[t,e,o])=>[s[0]*t+s[1]*e+s[2]*o,s[3]*t+s[4]*e+s[5]*o,s[6]*t+s[7]*e+s[8]*o];function F(s){let{focal:t,center:e,translation:o,width:r,height:n}=s;return{rotation:j(s.rotation),translation:o,focal:t,center:e,width:r,height:n}}function ht(s,t,e,o){let n=I(s.rotation,o).map((a,l)=>a+s.translation[l]),i=W(t,e),c=I(i,o);return{...s,rotation:i,translation:n.map((a,l)=>a-c[l])}}function O(s,t,e,o,r,n=[0,0]){return{...s,focal:s.focal*e,center:[(s.center[0]-t[0])*e+o/2+n[0],(s.center[1]-t[1])*e+r/2+n[1]],width:o,height:r}}function lt(s,t,e){let o=I(t,e),r=I(s.rotation,e.map((n,i)=>n-o[i]));return{...s,rotation:V(s.rotation,t),translation:s.translation.map((n,i)=>n+r[i])}}function C(s,t){let[e,o,r]=I(s.rotation,t).map((i,c)=>i+s.translation[c]),n=s.focal/-r;return[s.center[0]+e*n,s.center[1]-o*n,-r]}function K({rotation:s,translation:t}){return new Float32Array([s[0],s[3],s[6],0,s[1],s[4],s[7],0,s[2],s[5],s[8],0,t[0],t[1],t[2],1])}function q({focal:s,center:t,width:e,height:o,translation:r}){let n=-r[2],i=Math.max(n-450,n*.05,1),c=n+550;return new Float32Array([2*s/e,0,0,0,0,2*s/o,0,0,1-2*t[0]/e,2*t[1]/o-1,-(c+i)/(c-i),-1,0,0,-2*c*i/(c-i),0])}var w=class extends Error{},ft=/^[A-Za-z0-9_][A-Za-z0-9._-]*$/,Ot=64*2**20,Ct=256*2**20,Bt=16384,A=52,ut=8;async function pt(s){let t=new URL(s.endsWith("/")?s:s+"/",document.baseURI),e=async n=>{let i=await fetch(new URL(n,t));if(!i.ok)throw new w(`${n}: ${i.status} ${i.statusText}`);return new Uint8Array(await i.arrayBuffer())},o=["","web/"];t.pathname.endsWith(".avatar/")&&o.reverse();let r=null;for(let n of o){let i=c=>e(n+c);try{let c=JSON.parse(new TextDecoder().decode(await i("avatar.json")));if(!Array.isArray(c.files))return{description:c,file:i}}catch(c){if(!(c instanceof w))throw c;r??=c}}throw r??new w(`${s}: holds no web/avatar.json; bake it again`)}var Z=s=>s.geometry??"head.glb";function dt(s){let t=(i,c)=>{if(!i)throw new w(`the bundle's web/avatar.json: ${c}; bake it again`)};t(s&&s.$schema==="urn:bakery:schema:web-1","is not one");let e=String(s.asset?.version);t(/^1\.\d+$/.test(e),`has version ${e.slice(0,20)}, this player reads 1.x`),t(gt(s),"holds a number that is none");let o=s.expressions;t(Array.isArray(o)&&o.length===A,"lacks the 52 expressions"),t(ft.test(Z(s)),"names a file outside of its folder"),t(o.every(i=>/^[A-Za-z]{1,40}$/.test(i)),"has an odd expression"),t(s.keys?.length>=1&&s.keys.length<=ut,`needs 1 to ${ut} keys`),t(s.keys.every(i=>_(i.weights,A)),"keys lack weights"),t(_(s.lips?.rest,80)&&s.lips.shapes?.length===A,"lacks the lips"),t(s.lips.shapes.every(i=>_(i,80)),"lacks the lips"),t(s.mouths?.length>=1&&s.mouths.length<=300,"needs 1 to 300 mouths"),t(s.mouths.every(i=>_(i,80)),"mouths lack landmarks"),t(s.gaze?.length>=1&&s.gaze.every(i=>_(i,2)),"lacks gaze"),t(_(s.pose?.weights,A),"lacks the pose of the photo"),t(_(s.pivot,3)&&s.light?.length===9,"lacks its frame"),t(s.eyes?.cap>0&&_(s.eyes.degrees,2),"lacks eyes"),t(s.eyes.centers?.length===2&&s.eyes.centers.every(i=>_(i,3)),"lacks eyes");for(let i of["photo_camera","front_camera"]){let c=s[i];t(c&&c.focal>0&&_(c.center,2),`lacks ${i}`),t(_(c.rotation,3)&&_(c.translation,3),`lacks ${i}`),t(c.width>0&&c.height>0,`lacks ${i}`)}for(let i of["mouth_sheet","eye_cap_left","eye_cap_right"])t(_(s.uv?.[i],4),`lacks the place of ${i}`);let r=["neutral",...s.keys.map(i=>i.name),"gaze","mouths","masks","coverage"];for(let i of r)t(Object.hasOwn(s.atlases??{},i),"lacks a picture");for(let i of Object.values(s.atlases))t(ft.test(i.file??""),"names a file outside of its folder"),t(mt(i.columns)&&mt(i.rows),"has an odd grid"),t(i.names?.length<=i.columns*i.rows,"has an odd grid");let n=(i,c)=>t(s.atlases[i].names.length===c,`${i} differ in number`);n("gaze",s.gaze.length),n("mouths",s.mouths.length),n("masks",A)}var _=(s,t)=>Array.isArray(s)&&s.length===t&&s.every(e=>typeof e=="number"),mt=s=>Number.isInteger(s)&&s>=1&&s<=1024;function gt(s){return typeof s=="number"?Number.isFinite(s):s&&typeof s=="object"?Object.values(s).every(gt):!0}function zt(s){let t=new DataView(s.buffer,s.byteOffset,s.byteLength),e=o=>String.fromCharCode(...s.subarray(o,o+4));if(s.length>24&&t.getUint32(0)===2303741511)return[t.getUint32(16),t.getUint32(20)];if(s.length>30&&e(0)==="RIFF"&&e(8)==="WEBP"){let o=e(12);if(o==="VP8 ")return[t.getUint16(26,!0)&16383,t.getUint16(28,!0)&16383];if(o==="VP8L"){let r=t.getUint32(21,!0);return[(r&16383)+1,(r>>>14&16383)+1]}if(o==="VP8X"){let r=n=>t.getUint16(n,!0)+(s[n+2]<<16);return[r(24)+1,r(27)+1]}}throw new w("a picture of the bundle is neither PNG nor WebP; bake it again")}async function vt(s,t){let e=await s.file(t.file);if(e.length>Ct)throw new w(`${t.file}: too large`);let[o,r]=zt(e);if(o*r>Ot||Math.max(o,r)>Bt)throw new w(`${t.file}: ${o} x ${r} pixels, more than any bundle has`);if(o%t.columns||r%t.rows)throw new w(`${t.file}: does not divide into its grid; bake it again`);let n=e[0]===137?"image/png":"image/webp";return createImageBitmap(new Blob([e],{type:n}),{premultiplyAlpha:"none",colorSpaceConversion:"none"})}var b=class{constructor(t,e,o){this.gl=t,this.handle=t.createProgram();for(let[r,n]of[[t.VERTEX_SHADER,e],[t.FRAGMENT_SHADER,o]]){let i=t.createShader(r);t.shaderSource(i,`#version 300 es
`+n),t.compileShader(i),t.attachShader(this.handle,i),t.deleteShader(i)}t.linkProgram(this.handle),this.places=null}use(){let{gl:t}=this;if(t.useProgram(this.handle),this.places)return;if(!t.getProgramParameter(this.handle,t.LINK_STATUS)&&!t.isContextLost()){let o=t.getAttachedShaders(this.handle).map(r=>t.getShaderInfoLog(r));throw new w(`this browser's graphics refuse a shader: ${o.join(" ").slice(0,300)}`)}this.places=new Map;let e=t.getProgramParameter(this.handle,t.ACTIVE_UNIFORMS);for(let o=0;o<e;o++){let r=t.getActiveUniform(this.handle,o).name.replace("[0]","");this.places.set(r,t.getUniformLocation(this.handle,r))}}at(t){return this.places.get(t)??null}textures(t){let{gl:e}=this,o=0;for(let[r,[n,i]]of Object.entries(t))e.activeTexture(e.TEXTURE0+o),e.bindTexture(n,i),e.uniform1i(this.at(r),o++)}};function U(s,{format:t,width:e,height:o,layers:r=0,linear:n=!1}){let i=r?s.TEXTURE_2D_ARRAY:s.TEXTURE_2D,c=s.createTexture();s.bindTexture(i,c),r?s.texStorage3D(i,1,t,e,o,r):s.texStorage2D(i,1,t,e,o);let a=n?s.LINEAR:s.NEAREST;return s.texParameteri(i,s.TEXTURE_MIN_FILTER,a),s.texParameteri(i,s.TEXTURE_MAG_FILTER,a),s.texParameteri(i,s.TEXTURE_WRAP_S,s.CLAMP_TO_EDGE),s.texParameteri(i,s.TEXTURE_WRAP_T,s.CLAMP_TO_EDGE),c}var k=class{constructor(t,{format:e,width:o,height:r,count:n=1,linear:i=!1,depth:c=!1}){this.gl=t,this.width=o,this.height=r,this.textures=Array.from({length:n},()=>U(t,{format:e,width:o,height:r,linear:i})),this.handle=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.handle);let a=this.textures.map((l,h)=>(t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+h,t.TEXTURE_2D,l,0),t.COLOR_ATTACHMENT0+h));t.drawBuffers(a),this.depth=null,c&&(this.depth=t.createRenderbuffer(),t.bindRenderbuffer(t.RENDERBUFFER,this.depth),t.renderbufferStorage(t.RENDERBUFFER,t.DEPTH_COMPONENT24,o,r),t.framebufferRenderbuffer(t.FRAMEBUFFER,t.DEPTH_ATTACHMENT,t.RENDERBUFFER,this.depth)),this.complete=t.checkFramebufferStatus(t.FRAMEBUFFER)===t.FRAMEBUFFER_COMPLETE,t.bindFramebuffer(t.FRAMEBUFFER,null)}bind(){this.gl.bindFramebuffer(this.gl.FRAMEBUFFER,this.handle),this.gl.viewport(0,0,this.width,this.height)}dispose(){let{gl:t}=this;this.textures.forEach(e=>t.deleteTexture(e)),this.depth&&t.deleteRenderbuffer(this.depth),t.deleteFramebuffer(this.handle)}};var Gt=[0,2,4,8];function J(s,t,e){let o=s.length-e;if(s[0]!==160||o<1)throw new w("packed vertices of another version");let r=new Uint8Array(t*e),n=s.slice(o),i=Math.min((8192/e|0)&-16,256),c=new Uint8Array(256),a=1;for(let l=0;l<t;l+=i){let h=Math.min(i,t-l),d=h+15>>4;for(let f=0;f<e;f++){let p=a;a+=d+3>>2;for(let m=0;m<d;m++){let g=s[p+(m>>2)]>>((m&3)<<1)&3;a=Xt(s,a,Gt[g],c,m<<4)}if(a>o)throw new w("packed vertices that end too soon");let u=n[f];for(let m=0,g=l*e+f;m<h;m++,g+=e){let v=c[m];u=u+(v>>>1^-(v&1))&255,r[g]=u}n[f]=u}}return r}function Xt(s,t,e,o,r){if(e===0)return o.fill(0,r,r+16),t;if(e===8){for(let a=0;a<16;a++)o[r+a]=s[t+a];return t+16}let n=(1<<e)-1,i=8/e,c=t+16/i;for(let a=0;a<16;a++){let l=8-e-a%i*e,h=s[t+(a/i|0)]>>l&n;o[r+a]=h===n?s[c++]:h}return c}function Q(s,t){if(s[0]!==209)throw new w("packed indices of another version");let e=new Uint32Array(t),o=new Uint32Array(2),r=1;for(let n=0;n<t;n++){let i=0,c,a=0;do{if(r>=s.length)throw new w("packed indices that end too soon");c=s[r++],i|=(c&127)<<a,a+=7}while(c>127);let l=i&1,h=i>>>1;e[n]=o[l]+=h>>>1^-(h&1)}return e}var M=["eye_cap_left","eye_cap_right","skin","mouth_sheet","tongue","eye_socket","inside","teeth","tear","lashes"],tt=M.slice(7),wt=65535;function Et(s){let{document:t,binary:e}=$t(s),o=t.meshes?.[0],r=t.nodes?.[0]?.scale;(!o||!r||o.extras?.targetNames?.length!==A)&&T("lacks its 52 shapes");let n=r[0]*1e3,i=new Map(o.primitives.map(m=>[t.materials[m.material].name,m])),c=M.filter(m=>i.has(m));M.slice(0,4).some(m=>!i.has(m))&&T("lacks its skin, eyes or mouth");let a=m=>Vt(t,e,m),l=c.map(m=>t.accessors[i.get(m).attributes.POSITION].count),h=l.reduce((m,g)=>m+g,0);h>wt&&T(`has ${h} vertices, more than ${wt}`);let d=c.map(m=>t.accessors[i.get(m).indices].count),f={positions:new Float32Array(3*h),normals:new Int8Array(4*h),uv:new Float32Array(2*h),part:new Uint8Array(h),indices:new Uint16Array(d.reduce((m,g)=>m+g,0)),shapes:new Int16Array(A*4*h),reach:n,ranges:{},hair:Ht(t,a)},p=0,u=0;return c.forEach((m,g)=>{let{attributes:v,indices:E,targets:y}=i.get(m),L=a(v.POSITION);for(let x=0;x<L.length;x++)f.positions[3*p+x]=L[x]*n;f.normals.set(a(v.NORMAL),4*p),f.uv.set(a(v.TEXCOORD_0),2*p),f.part.fill(M.indexOf(m),p,p+l[g]);let R=a(E);for(let x=0;x<R.length;x++)R[x]>=l[g]&&T("has a triangle without a corner"),f.indices[u+x]=R[x]+p;y?.length!==A&&T("lacks its 52 shapes"),y.forEach((x,N)=>f.shapes.set(a(x.POSITION),4*(N*h+p))),f.ranges[m]=[u,R.length],p+=l[g],u+=R.length}),f}function Ht(s,t){let e=s.meshes.findIndex(h=>h.name==="hair");if(e<0||!s.meshes[e].primitives?.length)return null;let o=s.nodes.find(h=>h.mesh===e)?.scale?.[0]*1e3,{primitives:r}=s.meshes[e],{POSITION:n,NORMAL:i,TEXCOORD_0:c}=r[0].attributes,a={positions:t(n).map(h=>h*o),normals:t(i),uv:t(c),levels:[]},l=a.positions.length/3;(!(o>0)||a.normals.length!==4*l||a.uv.length!==2*l)&&T("has damaged hair");for(let{attributes:h,indices:d,extras:f}of r){let p=Uint32Array.from(t(d)),{level:u,cards:m}=f??{};(h.POSITION!==n||!(u>=0&&u<3)||!Array.isArray(m))&&T("has damaged hair"),p.some(E=>E>=l)&&T("has a triangle without a corner");let g=a.levels[u]??={cap:new Uint32Array(0),cards:new Uint32Array(0),starts:[]};if(!m.length){g.cap=p;continue}let v=0;g.starts=m.map(E=>Number.isInteger(E)&&E>0?(v+=3*E)-3*E:T("has damaged hair")),v!==p.length&&T("has damaged hair"),g.cards=p}return a}function T(s){throw new w(`the bundle's head for browsers ${s}; bake it again`)}function $t(s){let t=new DataView(s.buffer,s.byteOffset,s.byteLength);(s.length<20||t.getUint32(0,!0)!==1179937895)&&T("is no GLB file");let e=t.getUint32(12,!0);return 20+e+8>s.length&&T("is cut short"),{document:JSON.parse(new TextDecoder().decode(s.subarray(20,20+e))),binary:s.subarray(28+e)}}var Yt={5120:Int8Array,5122:Int16Array,5123:Uint16Array,5125:Uint32Array,5126:Float32Array};function Vt(s,t,e){let o=s.accessors[e],r=s.bufferViews[o.bufferView].extensions.EXT_meshopt_compression,{byteOffset:n=0,byteLength:i,byteStride:c,count:a,mode:l}=r;(a!==o.count||a>4*2**20||c>256)&&T("is damaged"),n+i>t.length&&T("is cut short");let h=t.subarray(n,n+i),d=Yt[o.componentType];return l==="ATTRIBUTES"?new d(J(h,a,c).buffer):d.from(Q(h,a))}var B=class{constructor(t,e){this.size=e.rest.length,this.known=new Float64Array(t.length*this.size),this.length=new Float64Array(t.length),t.forEach((o,r)=>{this.known.set(o,r*this.size),this.length[r]=Math.hypot(...o)}),this.rest=Float64Array.from(e.rest),this.shapes=e.shapes.map(o=>Float64Array.from(o)),this.moves=this.shapes.map(o=>o.some(r=>r!==0)),this.wanted=new Float64Array(this.size),this.score=new Float64Array(t.length),this.order=Array.from(t,(o,r)=>r),this.count=Math.min(50,t.length),this.index=new Uint16Array(this.count),this.weight=new Float64Array(this.count)}find(t){let{wanted:e,known:o,score:r,size:n,order:i}=this;e.set(this.rest);for(let u=0;u<t.length;u++){let m=t[u];if(m===0||!this.moves[u])continue;let g=this.shapes[u];for(let v=0;v<n;v++)e[v]+=m*g[v]}let c=0;for(let u=0;u<n;u++)c+=e[u]*e[u];let a=Math.sqrt(c);for(let u=0,m=0;u<r.length;u++){let g=0;for(let v=0;v<n;v++,m++)g+=o[m]*e[v];r[u]=g/(this.length[u]*a)}i.sort((u,m)=>r[m]-r[u]||u-m);let l=1-r[i[0]],h=Math.max(.25*l,1e-4),d=0,f=!1,p=new Float64Array(this.count);for(let u=0;u<this.count;u++)p[u]=Math.exp((l-(1-r[i[u]]))/h),d+=p[u];for(let u=0;u<this.count;u++){let m=p[u]/d;f||=this.index[u]!==i[u]||Math.abs(this.weight[u]-m)>1e-7,this.index[u]=i[u],this.weight[u]=m}return f}};function xt(s,t){let e=0,o=1/0;return s.forEach(([r,n],i)=>{let c=(r-t[0])**2+(n-t[1])**2;c<o&&([e,o]=[i,c])}),e}var yt=64,jt=.12,z=class{constructor(t,e){this.view=F(t.photo_camera),this.columns=yt,this.rows=Math.max(8,Math.round(yt*this.view.height/this.view.width)),this.step=e.reach/32767;let o=t.pose.weights,r=this.#t(e,o);this.mass=this.#o(r),this.cells=Int32Array.from(r.keys()).filter(c=>r[c]>=0);let n=this.cells.length,i=e.part.length;this.rest=new Float32Array(3*n),this.shapes=o.map(()=>new Int16Array(3*n)),this.cells.forEach((c,a)=>{let l=r[c];for(let h=0;h<3;h++)this.rest[3*a+h]=e.positions[3*l+h],this.shapes.forEach((d,f)=>{d[3*a+h]=e.shapes[4*(f*i+l)+h]})}),this.place=new Float32Array(3*n),this.values=new Float32Array(2*r.length),this.before=new Float32Array(2*n),this.#r(o,this.before)}#t(t,e){let{columns:o,rows:r}=this,[n,i]=t.ranges.skin,c=t.part.length,a=[...new Set(t.indices.subarray(n,n+i))],l=Float32Array.from({length:3*a.length},(u,m)=>t.positions[3*a[Math.floor(m/3)]+m%3]);e.forEach((u,m)=>{if(u)for(let g=0;g<a.length;g++){let v=4*(m*c+a[g]);for(let E=0;E<3;E++)l[3*g+E]+=u*this.step*t.shapes[v+E]}});let h=new Float32Array(2*a.length),d=this.#e(l,h),f=new Int32Array(o*r).fill(-1),p=new Float32Array(f.length).fill(1/0);for(let u=0;u<a.length;u++){let m=Math.floor(h[2*u]*o),g=Math.floor(h[2*u+1]*r);if(m<0||g<0||m>=o||g>=r)continue;let v=g*o+m;d[u]<p[v]&&([p[v],f[v]]=[d[u],a[u]])}return f}#e(t,e){let{rotation:o,translation:r,focal:n,center:i,width:c,height:a}=this.view,l=t.length/3,h=new Float32Array(l);for(let d=0;d<l;d++){let[f,p,u]=[t[3*d],t[3*d+1],t[3*d+2]];h[d]=-(o[6]*f+o[7]*p+o[8]*u+r[2]);let m=n/h[d];e[2*d]=(i[0]+(o[0]*f+o[1]*p+o[2]*u+r[0])*m)/c,e[2*d+1]=(i[1]-(o[3]*f+o[4]*p+o[5]*u+r[1])*m)/a}return h}#r(t,e){this.place.set(this.rest),this.shapes.forEach((o,r)=>{let n=t[r]*this.step;if(n!==0)for(let i=0;i<o.length;i++)this.place[i]+=n*o[i]}),this.#e(this.place,e)}#o(t){let{columns:e,rows:o}=this,r=Float32Array.from(t,c=>c>=0?0:1e3),n=(c,a,l)=>{r[a]+l<r[c]&&(r[c]=r[a]+l)};for(let c=0;c<2;c++)for(let a=0;a<r.length;a++){let l=c?r.length-1-a:a,h=l%e,d=(l-h)/e,f=c?1:-1;h+f>=0&&h+f<e&&n(l,l+f,1),d+f>=0&&d+f<o&&(n(l,l+f*e,1),h>0&&n(l,l+f*e-1,1.4),h<e-1&&n(l,l+f*e+1,1.4))}let i=jt*o;return r.map(c=>c===0?1:Math.min(Math.max(c/i-1,0),1))}at(t){let{cells:e,values:o,before:r}=this,n=new Float32Array(r.length);this.#r(t,n);for(let i=0;i<e.length;i++)o[2*e[i]]=r[2*i]-n[2*i],o[2*e[i]+1]=r[2*i+1]-n[2*i+1];return At(o,this.mass,this.columns,this.rows)}};function At(s,t,e,o){if(Math.min(e,o)<2)return s;let[r,n]=[e+1>>1,o+1>>1],i=new Float32Array(2*r*n),c=new Float32Array(r*n);for(let h=0;h<o;h++)for(let d=0;d<e;d++){let f=h*e+d,p=(h>>1)*r+(d>>1);c[p]+=t[f],i[2*p]+=t[f]*s[2*f],i[2*p+1]+=t[f]*s[2*f+1]}for(let h=0;h<c.length;h++){let d=c[h]>0?1/c[h]:0;i[2*h]*=d,i[2*h+1]*=d,c[h]=Math.min(1,c[h])}let a=At(i,c,r,n),l=new Float32Array(s.length);for(let h=0;h<o;h++)for(let d=0;d<e;d++){let f=h*e+d,p=Math.min(Math.max((d-.5)/2,0),r-1),u=Math.min(Math.max((h-.5)/2,0),n-1),[m,g]=[Math.floor(p),Math.floor(u)],[v,E]=[Math.min(m+1,r-1),Math.min(g+1,n-1)];for(let y=0;y<2;y++){let L=a[2*(g*r+m)+y]*(1-p+m)+a[2*(g*r+v)+y]*(p-m),R=a[2*(E*r+m)+y]*(1-p+m)+a[2*(E*r+v)+y]*(p-m),x=L*(1-u+g)+R*(u-g);l[2*f+y]=t[f]*s[2*f+y]+(1-t[f])*x}}return l}var G=`
vec3 toLinear(vec3 c) {
  return mix(c / 12.92, pow((max(c, 0.04045) + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}
vec3 toEncoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(c * 12.92, 1.055 * pow(max(c, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`,et=`
uniform vec3 light[9], fresh[9]; // the photo's, relative to its camera; another, relative to the head
uniform mat3 photographed; // head to the photo's camera
uniform float exposure; // keeps the face as bright as it was, on average
vec3 shine(vec3 rows[9], vec3 n) { // as bakery/geometry/harmonics.py
  return 0.282095 * rows[0] + 0.488603 * (n.y * rows[1] + n.z * rows[2] + n.x * rows[3])
    + 1.092548 * (n.x * n.y * rows[4] + n.y * n.z * rows[5] + n.x * n.z * rows[7])
    + 0.315392 * (3.0 * n.z * n.z - 1.0) * rows[6] + 0.546274 * (n.x * n.x - n.y * n.y) * rows[8];
}
float luma(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }
vec3 relit(vec3 n) { // what the photo's colours are multiplied by
  float was = luma(shine(light, photographed * n)) / max(luma(shine(light, vec3(0.0, 0.0, 1.0))), 1e-4);
  return exposure * max(shine(fresh, n), 0.02) / clamp(was, 0.45, 1.5);
}`,S=`
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}`,Tt=`
precision highp float;
uniform sampler2D atlas;
uniform int first, columns, count, side;
out vec4 mask;
float cell(int number) {
  if (number >= count) return 0.0;
  ivec2 corner = ivec2(number % columns, number / columns) * side;
  return texelFetch(atlas, corner + ivec2(gl_FragCoord.xy), 0).r;
}
void main() { mask = vec4(cell(first), cell(first + 1), cell(first + 2), cell(first + 3)); }`,_t=`
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray masks;
uniform int groups;
uniform int group[13];
uniform vec4 product[104]; // a_e^k a_e^t, four expressions each, eight keys a group
layout(location = 0) out vec4 low;
layout(location = 1) out vec4 high;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  low = vec4(0.0);
  high = vec4(0.0);
  for (int g = 0; g < groups; g++) {
    vec4 a = texelFetch(masks, ivec3(place, group[g]), 0);
    int k = 8 * group[g];
    low += vec4(dot(a, product[k]), dot(a, product[k + 1]), dot(a, product[k + 2]), dot(a, product[k + 3]));
    high += vec4(dot(a, product[k + 4]), dot(a, product[k + 5]), dot(a, product[k + 6]), dot(a, product[k + 7]));
  }
  float total = dot(low, vec4(1.0)) + dot(high, vec4(1.0));
  float scale = 1.0 / max(1.0, total); // w_0 + sum is 1 or, where w_0 is 0, the sum
  low *= scale;
  high *= scale;
}`,bt=`
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray faces;
uniform sampler2D low, high, hair;
uniform int keys;
uniform bool hairy;
out vec4 color;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec2 uv = gl_FragCoord.xy / vec2(textureSize(faces, 0).xy);
  vec4 one = texture(low, uv), two = texture(high, uv);
  float w[8] = float[](one.x, one.y, one.z, one.w, two.x, two.y, two.z, two.w);
  float rest = 1.0 - dot(one, vec4(1.0)) - dot(two, vec4(1.0));
  vec3 c = rest * texelFetch(faces, ivec3(place, 0), 0).rgb;
  for (int k = 0; k < keys; k++)
    if (w[k] > 1e-4) c += w[k] * texelFetch(faces, ivec3(place, k + 1), 0).rgb;
  if (hairy) {
    vec4 h = texelFetch(hair, place, 0);
    c = c * (1.0 - h.a) + h.rgb * h.a;
  }
  color = vec4(c, 1.0);
}`,Rt=`
precision highp float;
uniform sampler2D mouths;
uniform int columns, count;
uniform ivec2 cell;
uniform vec2 neighbour[50]; // index, weight
out vec4 median;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec3 seen[50];
  float total = 0.0;
  for (int n = 0; n < count; n++) {
    int index = int(neighbour[n].x);
    ivec2 corner = ivec2(index % columns, index / columns) * cell;
    seen[n] = floor(texelFetch(mouths, corner + place, 0).rgb * 255.0 + 0.5);
    total += neighbour[n].y;
  }
  vec3 value = vec3(0.0);
  for (float bit = 128.0; bit >= 1.0; bit *= 0.5) {
    vec3 most = value + bit - 1.0; // with this bit 0
    vec3 reached = vec3(0.0);
    for (int n = 0; n < count; n++) reached += neighbour[n].y * vec3(lessThanEqual(seen[n], most));
    value += bit * vec3(lessThan(reached, vec3(0.5 * total)));
  }
  median = vec4(value / 255.0, 1.0);
}`,Ft=`
precision highp float;
precision highp isampler2DArray;
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec2 texel;
layout(location = 3) in uint piece;
uniform mat4 view, projection;
uniform isampler2DArray shapes;
uniform int count;
uniform vec2 moving[52]; // shape, millimetres of a step
uniform vec2 cards; // how much of the left and of the right eye's lashes shows
const float BEHIND = 8.0; // mm
flat out float shows;
out vec2 uv;
out vec3 bent;
out vec2 place; // mm: height at rest and depth
flat out uint part;
void main() {
  vec3 p = position;
  ivec2 cell = ivec2(gl_VertexID & 255, gl_VertexID >> 8);
  for (int k = 0; k < count; k++)
    p += moving[k].y * vec3(texelFetch(shapes, ivec3(cell, int(moving[k].x)), 0).xyz);
  uv = texel;
  part = piece;
  bent = normal.xyz;
  place = vec2(position.y, p.z);
  shows = position.x < 0.0 ? cards.y : cards.x;
  vec4 seen = view * vec4(p, 1.0);
  gl_Position = projection * seen;
  if (piece == 3u) { // farther, for the tongue; render.BEHIND is the reference
    vec4 behind = projection * (seen - vec4(0.0, 0.0, BEHIND, 0.0));
    gl_Position.z = behind.z / behind.w * gl_Position.w;
  }
}`,kt=`
precision highp float;
precision highp sampler2DArray;
in vec2 uv;
in vec3 bent;
in vec2 place;
flat in float shows;
flat in uint part;
uniform sampler2D face, mouth, gaze, coverage, photo, flow, hair;
uniform sampler2DArray masks;
uniform vec4 places[3]; // rectangles of eye_cap_left, eye_cap_right, mouth_sheet in the atlas
uniform ivec2 eyeCell, eyeCorner;
uniform vec2 slide; // of the eyes' picture, beyond its own direction
uniform int layer, shown;
uniform bool lit, inPhoto, soft, geometry;
uniform float lips; // mm: how far forward they are at rest
uniform vec2 fade; // mm, where the bust ends and where it is whole
uniform vec4 frame; // of the photo: left, top, width, height in pixels of the target
uniform float tall; // pixels of the target
uniform float scale; // pixels a millimetre
const float SHADE = 1.4; // mm
out vec4 color;
${G}
${et}
vec3 four(sampler2D map, ivec2 corner, ivec2 size, vec2 local) {
  vec2 p = local * vec2(size) - 0.5;
  vec2 low = floor(p);
  vec2 t = p - low;
  ivec2 a = clamp(ivec2(low), ivec2(0), size - 1), b = clamp(ivec2(low) + 1, ivec2(0), size - 1);
  vec3 aa = toLinear(texelFetch(map, corner + a, 0).rgb);
  vec3 ba = toLinear(texelFetch(map, corner + ivec2(b.x, a.y), 0).rgb);
  vec3 ab = toLinear(texelFetch(map, corner + ivec2(a.x, b.y), 0).rgb);
  vec3 bb = toLinear(texelFetch(map, corner + b, 0).rgb);
  return mix(mix(aa, ba, t.x), mix(ab, bb, t.x), t.y);
}
// As the reference reads it: no mipmaps, colour multiplied by alpha before it is mixed.
vec4 exactCard(vec2 uv) {
  ivec2 size = textureSize(hair, 0);
  vec2 p = uv * vec2(size) - 0.5;
  ivec2 low = ivec2(floor(p));
  vec2 t = p - floor(p);
  vec4 sum = vec4(0.0);
  for (int k = 0; k < 4; k++) {
    ivec2 step = ivec2(k & 1, k >> 1);
    vec4 one = texelFetch(hair, clamp(low + step, ivec2(0), size - 1), 0);
    vec2 share = mix(1.0 - t, t, vec2(step));
    sum += share.x * share.y * vec4(one.rgb * one.a, one.a);
  }
  return vec4(sum.rgb / max(sum.a, 1e-6), sum.a);
}
float shade(float behind) { return 0.05 + 0.6 * exp(-max(behind, 0.0) / 13.0); }
vec3 heat(float x) {
  return clamp(vec3(1.9 * x, 2.4 * x - 0.7, 0.25 + 1.6 * x - 2.6 * x * x + 1.2 * x * x * x), 0.0, 1.0);
}
void main() {
  if (part > 7u) { // lashes and tear line
    vec4 card = soft ? texture(hair, uv) : exactCard(uv);
    color = vec4(toEncoded(card.rgb), card.a * shows);
    return;
  }
  vec3 c;
  float known = 1.0;
  if (part == 3u) {
    vec2 local = (uv - places[2].xy) / places[2].zw;
    c = four(mouth, ivec2(0), textureSize(mouth, 0), local);
    if (soft) { // the lips' shade, so that the sheet does not end at a line
      vec2 away = min(local, 1.0 - local) / max(fwidth(local), 1e-5) / scale; // mm
      c *= mix(vec3(0.42, 0.34, 0.33), vec3(1.0), smoothstep(0.0, SHADE, min(away.x, away.y)));
    }
  } else if (part < 2u) {
    vec4 box = places[int(part)];
    c = four(gaze, eyeCorner + ivec2(int(part), 0) * eyeCell, eyeCell, (uv - box.xy) / box.zw - slide);
  } else {
    c = texture(face, uv).rgb;
    if (part == 2u) known = texture(coverage, uv).r;
    else if (geometry) c *= shade(lips - place.y) * vec3(1.0, 0.93, 0.9); // light falls off behind the lips
  }
  if (layer == 1) {
    ivec3 size = textureSize(masks, 0);
    float a = texture(masks, vec3(uv, float(shown / 4)))[shown % 4];
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? toLinear(heat(a)) * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 2) {
    int kind = int(texelFetch(coverage, ivec2(uv * vec2(textureSize(coverage, 0))), 0).g * 4.25 + 0.5);
    vec3 tint = kind == 1 ? vec3(0.10, 0.55, 0.25) : kind == 2 ? vec3(0.10, 0.35, 0.75)
      : kind == 3 ? vec3(0.85, 0.45, 0.05) : kind == 4 ? vec3(0.65, 0.10, 0.45) : vec3(0.2);
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? tint * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 3) {
    vec2 line = abs(fract(uv * 32.0) - 0.5);
    float grid = smoothstep(0.46, 0.48, max(line.x, line.y));
    float check = mod(floor(uv.x * 32.0) + floor(uv.y * 32.0), 2.0);
    c = mix(vec3(uv, 0.35) * (0.55 + 0.35 * check), vec3(0.9), grid * 0.6);
  } else if (lit) {
    c *= relit(normalize(bent));
  }
  float alpha = 1.0;
  if (inPhoto) {
    vec2 here = (vec2(gl_FragCoord.x, tall - gl_FragCoord.y) - frame.xy) / frame.zw;
    vec3 around = texture(photo, here + texture(flow, here).xy).rgb;
    if (layer == 0) c = mix(around, c, known);
  } else if (soft) {
    alpha *= smoothstep(fade.x, fade.y, place.x);
  }
  color = vec4(toEncoded(c), alpha);
}`,Mt=`
precision highp float;
uniform sampler2D photo, flow;
uniform vec4 frame;
uniform vec2 size;
uniform bool inPhoto, plain;
uniform vec3 wall, floorTint;
out vec4 color;
${G}
float noise(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715)))); }
void main() {
  vec2 pixel = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
  if (plain) {
    color = vec4(toEncoded(vec3(0.18)), 1.0);
    return;
  }
  vec2 unit = pixel / size;
  vec2 away = (unit - vec2(0.5, 0.42)) * vec2(size.x / size.y, 1.0);
  vec3 c = mix(wall, floorTint, smoothstep(0.05, 1.0, length(away) * 1.15));
  vec3 encoded = c + (noise(gl_FragCoord.xy) - 0.5) / 255.0; // against bands
  if (inPhoto) {
    vec2 here = (pixel - frame.xy) / frame.zw;
    float far = max(max(-here.x, here.x - 1.0), max(-here.y, here.y - 1.0));
    vec3 around = textureLod(photo, clamp(here, vec2(0.02), vec2(0.98)), 6.0).rgb * 0.5
      + textureLod(photo, clamp(here, vec2(0.1), vec2(0.9)), 8.0).rgb * 0.5;
    encoded = toEncoded(around * mix(0.34, 0.12, smoothstep(0.0, 0.6, far)))
      + (noise(gl_FragCoord.xy) - 0.5) / 255.0;
    if (all(greaterThanEqual(here, vec2(0.0))) && all(lessThan(here, vec2(1.0))))
      encoded = toEncoded(texture(photo, here + texture(flow, here).xy).rgb);
  }
  color = vec4(encoded, 1.0);
}`;var Wt=240,Lt=[420,160],Kt=s=>`
precision highp float;
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec2 texel;
uniform mat4 view, projection;
uniform bool whole;
uniform vec2 fade; // mm, where the bust ends and where it is whole
${s==="lit"?`${et}
out vec3 tint;`:""}
out vec2 uv;
out float shows;
void main() {
  uv = texel;
  shows = whole ? 1.0 : smoothstep(fade.x, fade.y, position.y);
  ${s==="lit"?"tint = relit(normalize(normal.xyz));":""}
  gl_Position = projection * (view * vec4(position, 1.0));
}`,qt=s=>`
precision highp float;
${s==="lit"?"in vec3 tint;":""}
in vec2 uv;
in float shows;
uniform sampler2D atlas;
uniform float least; // alpha: 1 for the cap, which is opaque
out vec4 color;
${G}
vec4 exact() {
  ivec2 size = textureSize(atlas, 0);
  vec2 p = uv * vec2(size) - 0.5;
  ivec2 low = ivec2(floor(p));
  vec2 t = p - floor(p);
  vec4 sum = vec4(0.0);
  for (int k = 0; k < 4; k++) {
    ivec2 step = ivec2(k & 1, k >> 1);
    vec4 one = texelFetch(atlas, clamp(low + step, ivec2(0), size - 1), 0);
    vec2 share = mix(1.0 - t, t, vec2(step));
    sum += share.x * share.y * vec4(toLinear(one.rgb) * one.a, one.a);
  }
  return vec4(toEncoded(sum.rgb / max(sum.a, 1e-3)), sum.a);
}
void main() {
  color = ${s==="exact"?"exact()":"texture(atlas, uv)"};
  color.a = max(color.a, least) * shows;
  if (color.a < 0.002) discard;
  ${s==="lit"?"color.rgb = toEncoded(toLinear(color.rgb) * tint);":""}
}`,ot=(s,t)=>new b(s,Kt(t),qt(t)),X=class{#t;#e;#r;constructor(t,e){this.#t=t,this.#e=e.levels.map(r=>r&&{...r,middles:Zt(e,r),sorted:r.cards.slice(),seen:[]}),this.#r=t.createVertexArray(),t.bindVertexArray(this.#r);let o=(r,n,i,c,a)=>{t.bindBuffer(t.ARRAY_BUFFER,t.createBuffer()),t.bufferData(t.ARRAY_BUFFER,n,t.STATIC_DRAW),t.enableVertexAttribArray(r),t.vertexAttribPointer(r,i,c,a,0,0)};o(0,e.positions,3,t.FLOAT,!1),o(1,e.normals,4,t.BYTE,!0),o(2,e.uv,2,t.FLOAT,!1),t.bindBuffer(t.ELEMENT_ARRAY_BUFFER,t.createBuffer()),t.bindVertexArray(null),this.held=null}levelFor(t){let e=Wt*t.focal/-t.translation[2],o=globalThis.matchMedia?.("(pointer: coarse)").matches;return Math.min(Lt.filter(r=>e<r).length+Number(o??!1),Lt.length)}#o(t){for(let e=Math.min(Math.max(t,0),this.#e.length-1);e>=0;e--)if(this.#e[e])return this.#e[e];return this.#e.find(Boolean)}#s(t,e){let o=this.#t,r=e.slice(6),n=r.some((i,c)=>i!==t.seen[c]);if(n){let{middles:i,starts:c,cards:a,sorted:l}=t,h=Float64Array.from(c.keys(),p=>i[3*p]*r[0]+i[3*p+1]*r[1]+i[3*p+2]*r[2]),d=Array.from(c.keys()).sort((p,u)=>h[p]-h[u]),f=0;for(let p of d){let u=a.subarray(c[p],c[p+1]??a.length);l.set(u,f),f+=u.length}t.seen=r}(n||this.held!==t)&&(o.bufferData(o.ELEMENT_ARRAY_BUFFER,4*(t.cap.length+t.sorted.length),o.DYNAMIC_DRAW),o.bufferSubData(o.ELEMENT_ARRAY_BUFFER,0,t.cap),o.bufferSubData(o.ELEMENT_ARRAY_BUFFER,4*t.cap.length,t.sorted),this.held=t)}draw(t,e,o){let r=this.#t,n=this.#o(e),i=n?.[t].length;return i?(r.bindVertexArray(this.#r),this.#s(n,o),r.drawElements(r.TRIANGLES,i,r.UNSIGNED_INT,t==="cap"?0:4*n.cap.length),r.bindVertexArray(null),1):0}};function Zt({positions:s},{cards:t,starts:e}){let o=new Float64Array(3*e.length);return e.forEach((r,n)=>{let i=e[n+1]??t.length;for(let c=r;c<i;c++)for(let a=0;a<3;a++)o[3*n+a]+=s[3*t[c]+a]/(i-r)}),o}var H=256;async function it(s){let{atlases:t,keys:e}=s.description,r=["neutral",...e.map(i=>i.name),"gaze","mouths","masks","coverage","hair","hair_cards","photo"].filter(i=>Object.hasOwn(t,i)),n=await Promise.all(r.map(i=>vt(s,t[i])));return Object.fromEntries(r.map((i,c)=>[i,n[c]]))}var $=class{constructor(t,e,o,r){this.gl=t;let n=t.getParameter(t.MAX_TEXTURE_SIZE);for(let[i,c]of Object.entries(o))if(Math.max(c.width,c.height)>n)throw new w(`${i}: ${c.width} x ${c.height} texels, this device takes ${n}; bake with --preset mobile`);t.pixelStorei(t.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),t.pixelStorei(t.UNPACK_COLORSPACE_CONVERSION_WEBGL,t.NONE),t.pixelStorei(t.UNPACK_FLIP_Y_WEBGL,!1),this.side=o.neutral.width,this.faces=this.#t(["neutral",...e.keys.map(i=>i.name)].map(i=>o[i])),this.mouths=this.#e(o.mouths,t.RGBA8),this.gaze=this.#e(o.gaze,t.RGBA8),this.coverage=this.#e(o.coverage??st(255),t.RGBA8,!0),this.hairy=!!o.hair,this.hair=this.#e(o.hair??st(0),t.SRGB8_ALPHA8,!0,this.hairy),this.locks=r.hair&&o.hair_cards?this.#e(o.hair_cards,t.RGBA8,!0,!0):null,this.locks&&t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.LINEAR_MIPMAP_NEAREST),this.photo=this.#e(o.photo??st(0),t.SRGB8_ALPHA8,!0,!!o.photo),this.masks=this.#r(o.masks,e.atlases.masks),this.#o(r)}#t(t){let{gl:e,side:o}=this,r=U(e,{format:e.SRGB8_ALPHA8,width:o,height:o,layers:t.length});return t.forEach((n,i)=>{if(n.width!==o||n.height!==o)throw new w("face pictures differ in size; bake the bundle again");e.texSubImage3D(e.TEXTURE_2D_ARRAY,0,0,0,i,o,o,1,e.RGBA,e.UNSIGNED_BYTE,n)}),r}#e(t,e,o=!1,r=!1){let{gl:n}=this,i=n.createTexture();n.bindTexture(n.TEXTURE_2D,i);let{width:c,height:a}=t,l=r?Math.floor(Math.log2(Math.max(c,a)))+1:1;n.texStorage2D(n.TEXTURE_2D,l,e,c,a),t.data?n.texSubImage2D(n.TEXTURE_2D,0,0,0,c,a,n.RGBA,n.UNSIGNED_BYTE,t.data):n.texSubImage2D(n.TEXTURE_2D,0,0,0,n.RGBA,n.UNSIGNED_BYTE,t),r&&n.generateMipmap(n.TEXTURE_2D);let h=o?n.LINEAR:n.NEAREST;return n.texParameteri(n.TEXTURE_2D,n.TEXTURE_MIN_FILTER,r?n.LINEAR_MIPMAP_LINEAR:h),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_MAG_FILTER,h),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_S,n.CLAMP_TO_EDGE),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_T,n.CLAMP_TO_EDGE),i}#r(t,e){let{gl:o}=this,r=t.width/e.columns,n=Math.ceil(A/4),i=this.#e(t,o.RGBA8),c=U(o,{format:o.RGBA8,width:r,height:r,layers:n,linear:!0}),a=new b(o,S,Tt),l=o.createFramebuffer();o.bindFramebuffer(o.FRAMEBUFFER,l),o.viewport(0,0,r,r),o.disable(o.DEPTH_TEST),o.disable(o.BLEND),o.disable(o.CULL_FACE),a.use(),a.textures({atlas:[o.TEXTURE_2D,i]}),o.uniform1i(a.at("columns"),e.columns),o.uniform1i(a.at("count"),A),o.uniform1i(a.at("side"),r);for(let h=0;h<n;h++)o.framebufferTextureLayer(o.FRAMEBUFFER,o.COLOR_ATTACHMENT0,c,0,h),o.uniform1i(a.at("first"),4*h),o.drawArrays(o.TRIANGLES,0,3);return o.bindFramebuffer(o.FRAMEBUFFER,null),o.deleteFramebuffer(l),o.deleteTexture(i),o.deleteProgram(a.handle),this.maskSide=r,c}#o(t){let{gl:e}=this,o=t.part.length;this.array=e.createVertexArray(),e.bindVertexArray(this.array);let r=(l,h,d,f,p)=>{e.bindBuffer(e.ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ARRAY_BUFFER,h,e.STATIC_DRAW),e.enableVertexAttribArray(l),f===e.UNSIGNED_BYTE?e.vertexAttribIPointer(l,d,f,0,0):e.vertexAttribPointer(l,d,f,p,0,0)};r(0,t.positions,3,e.FLOAT,!1),r(1,t.normals,4,e.BYTE,!0),r(2,t.uv,2,e.FLOAT,!1),r(3,t.part,1,e.UNSIGNED_BYTE,!1),e.bindBuffer(e.ELEMENT_ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ELEMENT_ARRAY_BUFFER,t.indices,e.STATIC_DRAW),e.bindVertexArray(null);let n=Math.ceil(o/H);this.shapes=U(e,{format:e.RGBA16I,width:H,height:n,layers:A});let i=new Int16Array(4*H*n);for(let l=0;l<A;l++)i.set(t.shapes.subarray(4*l*o,4*(l+1)*o)),e.texSubImage3D(e.TEXTURE_2D_ARRAY,0,0,0,l,H,n,1,e.RGBA_INTEGER,e.SHORT,i);this.step=t.reach/32767;let c=l=>l.filter(h=>t.ranges[h]).map(h=>t.ranges[h]),a=M.filter(l=>!tt.includes(l));this.runs={image:rt(c(a.slice(0,6))),geometry:rt(c(a.filter(l=>l!=="mouth_sheet"))),cards:this.hairy?rt(c(tt)):[]}}};function rt(s){let t=[];for(let[e,o]of s){let r=t.at(-1);r&&r[0]+r[1]===e?r[1]+=o:t.push([e,o])}return t}var st=s=>({width:1,height:1,data:new Uint8Array(4).fill(s)});function Ut(s,t,e,o){let r=s.getExtension("EXT_color_buffer_float")||s.getExtension("EXT_color_buffer_half_float"),n=l=>new k(s,{format:l,width:t,height:t,linear:!0}),i=l=>new k(s,{format:l,width:e,height:e,count:2,linear:!0}),c=r&&{face:n(s.RGBA16F),weights:i(s.RGBA16F)};(!c||!c.face.complete||!c.weights.complete)&&(c={face:n(s.SRGB8_ALPHA8),weights:i(s.RGBA8)});let a=new k(s,{format:s.RGBA8,width:o[0],height:o[1]});return{...c,mouth:a}}var Jt=["color","mask","coverage","uv"],nt=-40,Qt=74,St=.25,te=[8,32],ee=[.2,.75];function at(s){return{weights:new b(s,S,_t),compose:new b(s,S,bt),median:new b(s,S,Rt),backdrop:new b(s,S,Mt),head:new b(s,Ft,kt),hair:{plain:ot(s,"plain")}}}var Y=class{#t;#e;#r;#o;#s;#i=null;#n=null;#h=null;#c=new Float32Array(416);#l=new Float32Array(100);#f=new Float32Array(104);#a;#m;#p;constructor(t,e,o,r,n){this.#t=t,this.#e=e,this.#r=o,this.#o=n,this.#s=new $(t,e,r,o),this.reach=[0,0],this.#s.locks&&(this.#i=new X(t,o.hair),this.reach=se(o.hair,e));let i=c=>{let{columns:a,rows:l}=e.atlases[c];return[r[c].width/a,r[c].height/l]};this.mouthCell=i("mouths"),this.gazeCell=i("gaze"),this.targets=Ut(t,this.#s.side,this.#s.maskSide,this.mouthCell),this.bottom=o.positions.reduce((c,a,l)=>l%3===1?Math.min(c,a):c,0),this.lips=ie(o,"mouth_sheet"),this.#a=j(e.photo_camera.rotation),this.#m=re(e.light,o,this.#a),this.#p=["Left","Right"].map(c=>e.expressions.indexOf("eyeBlink"+c)),this.stats={drawCalls:0,uniformBytes:0,milliseconds:0,medians:0,compositions:0,hairLevel:null}}start(){Object.assign(this.stats,{drawCalls:0,uniformBytes:0,medians:0,compositions:0,hairLevel:null});let t=this.#t;t.disable(t.DEPTH_TEST),t.disable(t.BLEND),t.disable(t.CULL_FACE)}compose(t,e,o){let r=this.#t,{weights:n,compose:i}=this.#o,c=this.#s,{keys:a}=this.#e,l=o&&c.hairy,h=[];this.#c.fill(0);for(let p=0;p<t.length;p++){let u=e?t[p]:0;if(u===0||!a.some(g=>g.weights[p]))continue;let m=p>>2;h.at(-1)!==m&&h.push(m),a.forEach((g,v)=>{this.#c[4*(8*m+v)+(p&3)]=g.weights[p]*u})}this.targets.weights.bind(),n.use(),n.textures({masks:[r.TEXTURE_2D_ARRAY,c.masks]}),r.uniform1i(n.at("groups"),h.length),h.length&&r.uniform1iv(n.at("group"),h),r.uniform4fv(n.at("product"),this.#c),this.#u(4+4*h.length+this.#c.byteLength),this.targets.face.bind(),i.use();let[d,f]=this.targets.weights.textures;i.textures({faces:[r.TEXTURE_2D_ARRAY,c.faces],low:[r.TEXTURE_2D,d],high:[r.TEXTURE_2D,f],hair:[r.TEXTURE_2D,c.hair]}),r.uniform1i(i.at("keys"),h.length?a.length:0),r.uniform1i(i.at("hairy"),Number(l)),this.#u(8),this.stats.compositions++}median(t){let e=this.#t,o=this.#o.median;for(let r=0;r<t.count;r++)this.#l[2*r]=t.index[r],this.#l[2*r+1]=t.weight[r];this.targets.mouth.bind(),o.use(),o.textures({mouths:[e.TEXTURE_2D,this.#s.mouths]}),e.uniform1i(o.at("columns"),this.#e.atlases.mouths.columns),e.uniform1i(o.at("count"),t.count),e.uniform2i(o.at("cell"),this.mouthCell[0],this.mouthCell[1]),e.uniform2fv(o.at("neighbour"),this.#l),this.#u(16+this.#l.byteLength),this.stats.medians++}pull(t){let e=this.#t;this.#n??=new z(this.#e,this.#r);let{columns:o,rows:r}=this.#n;this.#h??=U(e,{format:e.RG16F,width:o,height:r,linear:!0}),e.bindTexture(e.TEXTURE_2D,this.#h);let n=this.#n.at(t);e.texSubImage2D(e.TEXTURE_2D,0,0,0,o,r,e.RG,e.FLOAT,n)}#E(t,e){let[o,r]=[t.rotation,this.#a].map(c=>c.slice(6)),n=Math.min(o[0]*r[0]+o[1]*r[1]+o[2]*r[2],1),i=Dt(te,Math.acos(n)*180/Math.PI);return this.#p.map(c=>St+(1-St)*Math.max(i,Dt(ee,e[c])))}#d(t){let e=this.#t;for(let[o,r]of t)e.drawElements(e.TRIANGLES,r,e.UNSIGNED_SHORT,2*o),this.stats.drawCalls++}#u(t){this.#t.drawArrays(this.#t.TRIANGLES,0,3),this.stats.drawCalls++,this.stats.uniformBytes+=t}picture(t,{weights:e,gaze:o,options:r,inPhoto:n,shown:i},c){let a=this.#t,l=this.#e,h=this.#s,{backdrop:d,head:f}=this.#o;a.disable(a.BLEND),a.disable(a.CULL_FACE),a.disable(a.DEPTH_TEST);let p=t.focal/l.photo_camera.focal,u=[t.center[0]-l.photo_camera.center[0]*p,t.center[1]-l.photo_camera.center[1]*p,l.photo_camera.width*p,l.photo_camera.height*p],m=n?this.#h:h.hair;d.use(),d.textures({photo:[a.TEXTURE_2D,h.photo],flow:[a.TEXTURE_2D,m]}),a.uniform4fv(d.at("frame"),u),a.uniform2f(d.at("size"),t.width,t.height),a.uniform1i(d.at("inPhoto"),Number(n)),a.uniform1i(d.at("plain"),Number(c&&!n)),a.uniform3fv(d.at("wall"),r.wall),a.uniform3fv(d.at("floorTint"),r.floor),this.#u(56),a.enable(a.DEPTH_TEST),a.clear(a.DEPTH_BUFFER_BIT),a.enable(a.CULL_FACE),c||(a.enable(a.BLEND),a.blendFunc(a.SRC_ALPHA,a.ONE_MINUS_SRC_ALPHA));let g=this.#i&&r.hair&&r.layer==="color";g&&(a.disable(a.CULL_FACE),this.#g("cap",t,r,n,c),a.enable(a.CULL_FACE)),f.use(),f.textures({face:[a.TEXTURE_2D,this.targets.face.textures[0]],mouth:[a.TEXTURE_2D,this.targets.mouth.textures[0]],gaze:[a.TEXTURE_2D,h.gaze],coverage:[a.TEXTURE_2D,h.coverage],photo:[a.TEXTURE_2D,h.photo],flow:[a.TEXTURE_2D,m],hair:[a.TEXTURE_2D,h.hair],masks:[a.TEXTURE_2D_ARRAY,h.masks],shapes:[a.TEXTURE_2D_ARRAY,h.shapes]});let v=0;for(let P=0;P<e.length;P++)e[P]!==0&&(this.#f[2*v]=P,this.#f[2*v+++1]=e[P]*h.step);let E=xt(l.gaze,o),y=2*l.eyes.cap,{columns:L}=l.atlases.gaze,[R,x]=this.gazeCell;a.uniformMatrix4fv(f.at("view"),!1,K(t)),a.uniformMatrix4fv(f.at("projection"),!1,q(t)),a.uniform1i(f.at("count"),v),v&&a.uniform2fv(f.at("moving"),this.#f.subarray(0,2*v));let{uv:N}=l;a.uniform4fv(f.at("places"),[...N.eye_cap_left,...N.eye_cap_right,...N.mouth_sheet]),a.uniform2i(f.at("eyeCell"),R/2,x),a.uniform2i(f.at("eyeCorner"),E%L*R,Math.floor(E/L)*x),a.uniform2f(f.at("slide"),(o[0]-l.gaze[E][0])/y,(l.gaze[E][1]-o[1])/y),a.uniform1i(f.at("layer"),Jt.indexOf(r.layer)),a.uniform1i(f.at("shown"),i),a.uniform1i(f.at("inPhoto"),Number(n)),a.uniform1i(f.at("soft"),+!c),a.uniform1f(f.at("scale"),-t.focal/t.translation[2]),this.#v(f,r,n||c),a.uniform2fv(f.at("cards"),this.#E(t,e)),a.uniform1f(f.at("lips"),this.lips),a.uniform1i(f.at("geometry"),+(r.mouth==="geometry")),a.uniform2fv(f.at("fade"),this.#w),a.uniform4fv(f.at("frame"),u),a.uniform1f(f.at("tall"),t.height),this.stats.uniformBytes+=128+8*v+48+24+24+256+8+28+8,a.bindVertexArray(h.array),this.#d(r.mouth==="geometry"?h.runs.geometry:h.runs.image),r.layer==="color"&&(a.disable(a.CULL_FACE),a.enable(a.BLEND),a.blendFunc(a.SRC_ALPHA,a.ONE_MINUS_SRC_ALPHA),a.depthMask(!1),this.#d(h.runs.cards),g&&this.#g("cards",t,r,n,c),a.depthMask(!0)),a.bindVertexArray(null)}#g(t,e,o,r,n){let i=this.#t,c=n?"exact":o.light&&!r?"lit":"plain",a=this.#o.hair[c]??=ot(i,c);a.use(),a.textures({atlas:[i.TEXTURE_2D,this.#s.locks]}),i.uniformMatrix4fv(a.at("view"),!1,K(e)),i.uniformMatrix4fv(a.at("projection"),!1,q(e)),i.uniform1f(a.at("least"),+(t==="cap")),i.uniform1i(a.at("whole"),Number(r||n)),i.uniform2fv(a.at("fade"),this.#w),c==="lit"&&this.#v(a,o,!1);let l=o.hairLevel??(n?0:this.#i.levelFor(e));this.stats.drawCalls+=this.#i.draw(t,l,e.rotation),this.stats.hairLevel=l,this.stats.uniformBytes+=408}#v(t,{light:e},o){let r=this.#t;r.uniform1i(t.at("lit"),Number(e&&!o)),r.uniform3fv(t.at("light"),this.#e.light.flat()),r.uniform3fv(t.at("fresh"),oe(e??this.#e.light)),r.uniformMatrix3fv(t.at("photographed"),!0,this.#a),r.uniform1f(t.at("exposure"),this.#m)}get#w(){return[this.bottom+2,this.bottom+Qt]}};function Dt(s,t){let[e,o]=s,r=Math.min(Math.max((t-e)/(o-e),0),1);return r*r*(3-2*r)}function oe(s){let t=Array.isArray(s)?s.flat():[];if(t.length!==27||!t.every(Number.isFinite))throw new w("options.light: give nine rows of three numbers, or null");return t}function re(s,t,e){let o=(a,l,h)=>[.282095,.488603*l,.488603*h,.488603*a,1.092548*a*l,1.092548*l*h,.315392*(3*h*h-1),1.092548*a*h,.546274*(a*a-l*l)].reduce((f,p,u)=>f+p*(.2126*s[u][0]+.7152*s[u][1]+.0722*s[u][2]),0),r=Math.max(o(0,0,1),1e-4),n=M.indexOf("skin"),i=0,c=0;for(let a=0;a<t.part.length;a++){let l=[0,1,2].map(p=>t.normals[4*a+p]/127),[h,d,f]=[0,3,6].map(p=>e[p]*l[0]+e[p+1]*l[1]+e[p+2]*l[2]);t.part[a]!==n||f<.3||(i+=1/Math.min(Math.max(o(h,d,f)/r,.45),1.5),c++)}return c?c/i:1}function se({positions:s},t){let e=F(t.front_camera),[o,r]=[0,0];for(let n=0;n<s.length;n+=3){let[i,c,a]=s.subarray(n,n+3),[,l,h]=C(e,[i,c,a]);o=Math.max(o,e.height/2-l),r=Math.max(r,Math.hypot(i,a-nt)*e.focal/h)}return[o,r]}function ie(s,t){let[e,o]=s.ranges[t],r=0;for(let n=e;n<e+o;n++)r+=s.positions[3*s.indices[n]+2];return r/o}var Nt=.48,ne=[0,-75,-45],Ve=[32,24],Pt=[35,30];async function je(s,{canvas:t,antialias:e=!0}){let o=t.getContext("webgl2",{antialias:e,alpha:!1,powerPreference:"high-performance"});if(!o)throw new w("this browser has no WebGL 2; update it, or turn hardware acceleration on");let r=typeof s=="string"?await pt(s):s;dt(r.description);let n=at(o),[i,c]=await Promise.all([it(r),r.file(Z(r.description))]);return new ct(o,r,i,Et(c),n)}var ct=class{#t;#e;#r;#o;#s=!1;#i=!0;#n=!0;#h="";constructor(t,e,o,r,n){this.#t=t,this.#e=e,this.#r=r;let i=e.description;this.about=i,this.expressions=i.expressions,this.canvas=t.canvas,this.weights=new Float32Array(i.expressions.length),this.index=new Map(i.expressions.map((c,a)=>[c,a])),this.hasPhoto=!!i.atlases.photo,this.hasHair=!!(i.atlases.hair||i.atlases.hair_cards),this.options={stage:"studio",dynamic:!0,hair:!0,hairLevel:null,mouth:"image",light:null,layer:"color",layerExpression:"jawOpen",wall:[.36,.37,.39],floor:[.13,.135,.15]},this.orbit={yaw:0,pitch:0,zoom:1,shift:[0,0]},this.head=[0,0,0],this.direction=null,this.mouths=new B(i.mouths,i.lips),this.#c(o,n),this.canvas.addEventListener("webglcontextlost",c=>{c.preventDefault(),this.#s=!0}),this.canvas.addEventListener("webglcontextrestored",()=>this.#l())}#c(t,e){this.#o=new Y(this.#t,this.about,this.#r,t,e),this.stats=this.#o.stats,Object.values(t).forEach(o=>o.close()),this.mouths.weight.fill(-1),this.#i=this.#n=!0}async#l(){let t=at(this.#t);this.#c(await it(this.#e),t),this.#s=!1,this.canvas.dispatchEvent(new Event("avatarrestored"))}set(t){for(let[e,o]of Object.entries(t)){let r=this.index.get(e);if(r===void 0)throw new w(`no expression '${String(e).slice(0,40)}'`);if(!Number.isFinite(o))throw new w(`${e}: ${o} is no weight`);let n=Math.fround(Math.min(Math.max(o,0),1));this.weights[r]!==n&&(this.weights[r]=n,e.startsWith("eyeLook")&&(this.direction=null),this.#i=this.#n=!0)}return this}get(t){return this.weights[this.index.get(t)]}reset(){return this.weights.fill(0),this.direction=null,this.head=[0,0,0],this.#i=this.#n=!0,this}look(t,e){if(!Number.isFinite(t+e))throw new w("gaze is no number");let[o,r]=this.about.eyes.degrees;for(let[n,i]of[["Left",1],["Right",-1]])this.set({["eyeLookOut"+n]:Number(i)*t/o,["eyeLookIn"+n]:-Number(i)*t/o,["eyeLookUp"+n]:e/r,["eyeLookDown"+n]:-e/r});return this.direction=[t,e],this}get gaze(){if(this.direction)return this.direction.map((i,c)=>Math.min(Math.max(i,-Pt[c]),Pt[c]));let[t,e]=this.about.eyes.degrees,o=i=>this.get(i),r=o("eyeLookOutLeft")-o("eyeLookInLeft")-o("eyeLookOutRight")+o("eyeLookInRight"),n=o("eyeLookUpLeft")-o("eyeLookDownLeft")+o("eyeLookUpRight")-o("eyeLookDownRight");return[t*r/2,e*n/2]}turn(t,e,o=0){if(!Number.isFinite(t+e+o))throw new w("a head turn is no number");return this.head=[t,e,o],this}get inPhoto(){return this.options.stage==="photo"&&this.hasPhoto}view(t=this.canvas.width,e=this.canvas.height){let{about:o,orbit:r}=this,n=r.shift.map(p=>p*e);if(this.inPhoto){let{width:p,height:u}=o.photo_camera,m=Math.min(t/p,e/u)*r.zoom;return O(F(o.photo_camera),[p/2,u/2],m,t,e,n)}let i=F(o.front_camera),c=.74*Math.min(t*1.12,e)/i.width,[a,l]=this.options.hair?this.#o.reach:[0,0],h=Math.min(c,Nt*e/a,Nt*t/l)*r.zoom,d=[i.width/2,i.height*.5],f=ht(O(i,d,h,t,e,n),r.yaw,r.pitch,[0,o.pivot[1],nt]);return this.head.some(Boolean)?lt(f,W(...this.head),ne):f}frontView(t){let e=F(this.about.front_camera);return O(e,[e.width/2,e.height/2],t/e.width,t,t)}eyes(){let t=this.view();return this.about.eyes.centers.map(([e,o,r])=>{let[n,i,c]=C(t,[e,o,r+11]);return[n,i,13*t.focal/c]})}render(){if(this.#s)return;let t=performance.now();this.#a();let e=this.#t;e.bindFramebuffer(e.FRAMEBUFFER,null),e.viewport(0,0,this.canvas.width,this.canvas.height),this.#o.picture(this.view(),this.#f(),!1),this.stats.milliseconds=performance.now()-t}capture({width:t,height:e,view:o=this.view(t,e)}){let r=this.#t;this.#a();let n=new k(r,{format:r.RGBA8,width:t,height:e,depth:!0});n.bind(),this.#o.picture(o,this.#f(),!0);let i=It(r,t,e);return n.dispose(),ae(i,t,e)}mouthSheet(){this.#a();let{mouth:t}=this.#o.targets;return t.bind(),{width:t.width,height:t.height,data:It(this.#t,t.width,t.height)}}#f(){let{weights:t,gaze:e,options:o,inPhoto:r}=this;return{weights:t,gaze:e,options:o,inPhoto:r,shown:this.index.get(o.layerExpression)??0}}#a(){let t=this.#o,{dynamic:e,hair:o}=this.options;t.start();let r=`${e} ${o}`;(this.#i||r!==this.#h)&&(t.compose(this.weights,e,o),this.mouths.find(this.weights)&&t.median(this.mouths),this.#i=!1,this.#h=r),this.inPhoto&&this.#n&&(t.pull(this.weights),this.#n=!1)}dispose(){this.#t.getExtension("WEBGL_lose_context")?.loseContext()}};function It(s,t,e){let o=new Uint8Array(4*t*e);return s.pixelStorei(s.PACK_ALIGNMENT,1),s.readPixels(0,0,t,e,s.RGBA,s.UNSIGNED_BYTE,o),s.bindFramebuffer(s.FRAMEBUFFER,null),o}function ae(s,t,e){let o=new Uint8Array(s.length);for(let r=0;r<e;r++)o.set(s.subarray(4*t*r,4*t*(r+1)),4*t*(e-1-r));return o}export{ct as Avatar,w as AvatarError,Ve as MOST_GAZE,Q as decodeIndices,J as decodeVertices,je as load,Et as parseHead};
